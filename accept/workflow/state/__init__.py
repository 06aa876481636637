"""Events of a unit in the workflow, and the state that they fold into."""
