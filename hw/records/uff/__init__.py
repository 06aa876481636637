"""Universal files: data set 58 "function at nodal DOF", in the units of its labels, types and data set 164."""
