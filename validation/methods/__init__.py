"""How a method is called, and methods to compare with, short and without what is special to this project: classical
sensitivity updating, sparse regression on linearised effects, Bayesian model selection over single effects."""
