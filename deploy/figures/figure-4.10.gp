# SPDX-License-Identifier: Apache-2.0
# Times of the iteration, the march and implicit Euler against the step and the mesh.
load directory."/style.gp"
set multiplot layout 1,2
set logscale xy
set format y "10^{%L}"
set ylabel "processor time in s, one thread"
set xlabel "h"
unset key
set title "Δx = 1/".fixed_cells
plot "4.10-steps.csv" using (4/$1):2 skip 1 with linespoints pt 7 lc rgb blue title "iteration, one window", \
     "" using (4/$1):3 skip 1 with linespoints pt 4 lc rgb green title "march", \
     "" using (4/$1):4 skip 1 with linespoints pt 6 lc rgb orange title "implicit Euler (sparse)"
set logscale x 2
set key top left
set xlabel "1/Δx"
set title "h = 0.01"
plot "4.10-cells.csv" using 1:2 skip 1 with linespoints pt 7 lc rgb blue title "iteration, one window", \
     "" using 1:3 skip 1 with linespoints pt 4 lc rgb green title "march", \
     "" using 1:4 skip 1 with linespoints pt 6 lc rgb orange title "implicit Euler (sparse)"
unset multiplot
