"""What a person runs."""

import os

# The checks multiply small matrices: a linear algebra library that starts threads for each product loses more time than
# it gains, all the more with a worker per core. Must stand before numpy is imported; whoever sets these keeps them.
for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
