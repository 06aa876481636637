"""Tests of residuals against chance."""
