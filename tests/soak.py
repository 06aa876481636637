"""Whether the heavy proofs run in full: `make soak` sets ACCEPT_SOAK=1."""

import os

SOAK = os.environ.get("ACCEPT_SOAK") == "1"
