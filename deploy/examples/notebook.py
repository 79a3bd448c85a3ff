# SPDX-License-Identifier: Apache-2.0
"""An oscillator against a stop, from Python. The cells (# %%) run in notebooks and editors.

    DLCSD=build/quickstart/server/dlcsd PYTHONPATH=client/python/src python3 deploy/examples/notebook.py
"""

# %% An oscillator that is driven against a compliant stop at x = -0.5: the stop pushes with y >= 0.
import dlcs

stiffness = 100.0
stop = dlcs.solve(
    A=[[0, 1], [-1, -0.1]],
    B=[[0], [1]],
    N=[[1, 0]],
    M=[[1 / stiffness]],
    f=["0", "cos(1.2*t)"],
    g=[0.5],
    x0=[0, 0],
    t_span=(0, 40),
    tol=1e-8,
)
print(stop.message)
print(f"{stop.t_events.size - 1} contacts and releases; the largest force is {stop.y.max():.4f}")

# %% The same with a force given by a program, and the position between the nodes.
import math

again = dlcs.solve(
    A=[[0, 1], [-1, -0.1]],
    B=[[0], [1]],
    N=[[1, 0]],
    M=[[1 / stiffness]],
    f=lambda t: [0, math.cos(1.2 * t)],
    g=[0.5],
    x0=[0, 0],
    t_span=(0, 40),
    tol=1e-8,
)
print(again.message)
print(f"x(12.345) = {again(12.345)[0]:.8f}, from the formula {stop(12.345)[0]:.8f}")

# %% A picture, where matplotlib is installed.
try:
    import matplotlib
except ImportError:
    print("no picture: matplotlib is not installed")
else:
    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure, (above, below) = pyplot.subplots(2, 1, sharex=True)
    above.plot(stop.t, stop.x[0])
    above.axhline(-0.5, color="gray", linewidth=0.5)
    above.set_ylabel("position")
    below.plot(stop.t, stop.y[0])
    below.set_ylabel("force of the stop")
    below.set_xlabel("t")
    figure.savefig("notebook.png")
    print("notebook.png")
