"""Tests of residuals against chance, and every threshold."""
