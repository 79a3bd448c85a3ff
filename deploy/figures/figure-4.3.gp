# SPDX-License-Identifier: Apache-2.0
# Accuracy of the converged solution of the small example against the step and the number of nodes on the contour.
load directory."/style.gp"
set multiplot layout 1,2
set logscale y
set format y "10^{%L}"
set ylabel "error"
set logscale x 2
set format x "2^{%L}"
set xlabel "h"
set key bottom right
set title "P = 64"
plot "4.3-steps.csv" using 1:(5*$1) skip 1 with lines dt 2 lc rgb black title "5h", \
     "" using 1:2 skip 1 with linespoints pt 6 lc rgb blue title "e_x", \
     "" using 1:3 skip 1 with linespoints pt 2 lc rgb orange title "e_y"
unset logscale x
set format x "%g"
set xlabel "P"
set yrange [1e-9:*]
set key bottom left
set title "h = 2^{−10}"
plot "4.3-nodes.csv" using 1:(exp(-2.06*sqrt($1))/sqrt($1)) skip 1 with lines dt 2 lc rgb black \
     title "exp(−2.06√P)/√P", \
     "" using 1:2 skip 1 with linespoints pt 6 lc rgb blue title "e_x", \
     "" using 1:3 skip 1 with linespoints pt 2 lc rgb orange title "e_y"
unset multiplot
