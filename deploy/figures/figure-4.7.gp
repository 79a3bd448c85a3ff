# SPDX-License-Identifier: Apache-2.0
# The boundary values V(0, x2, t) of iterates 1, 3 and 5 and of the converged solution.
load directory."/style.gp"
set multiplot layout 2,2
set xlabel "t" offset 0,-0.5
set ylabel "x_2"
set view 52, 325, 1.1, 1.1
set zrange [-0.2:1.2]
set xyplane relative 0
set ztics 0.5
set ytics 0.5
set xtics 1
set hidden3d
unset key
set bmargin -1
set border 31
set palette defined (0 "#f7fbff", 0.5 "#6baed6", 1 "#08306b")
set cbrange [-0.2:1.2]
unset colorbox
set pm3d depthorder border linecolor rgb "#666666" linewidth 0.25
do for [which in "1 3 5 converged"] {
  set title (which eq "converged" ? "converged" : "iterate ".which).": V(0, x_2, t)" offset 0,-0.5
  splot "4.7-".which."-surface.csv" using 1:2:3 with pm3d
}
unset multiplot
