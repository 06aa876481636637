"""Instruments written from the documents alone, a second time, by a person who had read neither driver nor peer.

`wires.py` and the five files of instruments were whole before a driver was opened at one of them."""
