# SPDX-License-Identifier: Apache-2.0
# Convergence of the iteration on the Signorini problem: three steps, and several meshes.
load directory."/style.gp"
set multiplot layout 1,2
# (4.8), for T = 4
tolerance(cells, steps) = (4 / steps < 1 / cells**2 ? 4 / steps : 1 / cells**2) / 10
set logscale y
set format y "10^{%L}"
set xlabel "iteration k"
set ylabel "max_j ‖x_j^k − x_j‖_∞"
set yrange [1e-12:*]
set xrange [0.5:*]
set key outside below horizontal center maxcols 2
set bmargin 7.5
colors = blue." ".orange." ".green." ".purple
set title "Δx = 1/".fixed_cells
plot for [i=1:words(steps)] "4.6-steps-".word(steps, i)."-history.csv" using 1:2 skip 1 \
     with linespoints pt i+3 ps 0.7 lc rgb word(colors, i) title "h = ".sprintf("%g", 4.0/word(steps, i)), \
     for [i=1:words(steps)] tolerance(real(fixed_cells), real(word(steps, i))) with lines dt 3 lw 1.5 \
          lc rgb word(colors, i) notitle
set title "h = 0.01"
plot for [i=1:words(cells)] "4.6-cells-".word(cells, i)."-history.csv" using 1:2 skip 1 \
     with linespoints pt i+3 ps 0.7 lc rgb word(colors, i) title "Δx = 1/".word(cells, i), \
     for [i=1:words(cells)] tolerance(real(word(cells, i)), 400.0) with lines dt 3 lw 1.5 lc rgb word(colors, i) notitle
unset multiplot
