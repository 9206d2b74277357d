# SPDX-License-Identifier: MIT
"""Where samples go, and what they say together. Pure numpy; gpu/accumulation.py draws what is planned here."""
