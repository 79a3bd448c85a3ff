#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes american-put.json: an American put option on a grid of prices.

    python3 american_put.py [STEP] > put.json       STEP: distance of the prices, 1 by default
"""

import json
import sys

step = float(sys.argv[1]) if len(sys.argv) > 1 else 1.0
strike, rate, volatility, maturity = 100, 0.1, 0.2, 1
low, high = 80, 160  # below 80 one exercises at once, above 160 the option is worth nothing
prices = [low + step * k for k in range(1, round((high - low) / step))]


def payoff(price):
    return max(strike - price, 0)


def number(value):
    return float(f"{value:.15g}")  # what people would write: 12.5, not 12.500000000000002


def entries(price):
    """Of V' in terms of V at the price below, here and above: central differences."""
    diffusion, drift = (volatility * price / step) ** 2 / 2, rate * price / step / 2
    return [number(diffusion - drift), number(-2 * diffusion - rate), number(diffusion + drift)]


def name(letter, price):
    return f"{letter}{price:g}".replace(".", "_")


below, here, above = zip(*map(entries, prices))
size = len(prices)
identity = {"rows": size, "columns": size, "diagonals": {"0": 1}}
problem = {
    "$schema": "../../client/problem.schema.json",
    "name": "American put",
    "about": f"strike {strike}, rate {rate}, volatility {volatility}; t is the time to maturity. Made by "
    "american_put.py; see client/guide",
    "states": [name("V", price) for price in prices],
    "pairs": [name("S", price) for price in prices],
    "A": {"rows": size, "columns": size, "diagonals": {"-1": below[1:], "0": here, "1": above[:-1]}},
    "B": identity,
    "N": identity,
    "M": {"rows": size, "columns": size, "diagonals": {}},
    "f": [number(below[0] * payoff(low))] + [0] * (size - 1),
    "g": [-payoff(price) for price in prices],
    "x0": [payoff(price) for price in prices],
    "T": maturity,
}
print("{")
print(",\n".join(f"  {json.dumps(key)}: {json.dumps(value)}" for key, value in problem.items()))
print("}")
