"""Commands that judge and compare units, and the specs they are judged by."""
