# SPDX-License-Identifier: Apache-2.0
# Convergence of the iteration on the small example for two steps, with the bound of Theorem 2.2.
load directory."/style.gp"
set multiplot layout 1,2
set logscale y
set format y "10^{%L}"
set xlabel "iteration k"
set ylabel "max_j ‖x_j^k − x_j‖_∞"
set xrange [0.5:*]
# The bound soon leaves the picture, which would show nothing else.
set yrange [1e-16:1e14]
set key top right
do for [power in "5 7"] {
  set title "h = 2^{−".power."}"
  plot "4.1-h".power."-history.csv" using 1:(10**$4) skip 1 with linespoints pt 4 ps 0.8 lc rgb orange \
       title "Theorem 2.2", \
       "" using 1:2 skip 1 with linespoints pt 7 ps 0.8 lc rgb blue title "measured"
}
unset multiplot
