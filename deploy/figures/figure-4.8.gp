# SPDX-License-Identifier: Apache-2.0
# Iterates 1, 3 and 5 and the converged solution at t = 4, and at x2 = 1/2.
load directory."/style.gp"
set multiplot layout 1,2
set ylabel "V(0, x_2, t)"
set key at graph 0.74,0.84
set xlabel "x_2"
set title "t = 4"
plot for [i=1:3] "4.8-space.csv" using 1:i+1 skip 1 with lines dt i+1 lw 2 \
     lc rgb word(orange." ".green." ".purple, i) title "k = ".word("1 3 5", i), \
     "" using 1:5 skip 1 with lines lw 1.5 lc rgb black title "converged"
set xlabel "t"
unset key
set xtics 1
set title "x_2 = 1/2"
plot for [i=1:3] "4.8-time.csv" using 1:i+1 skip 1 with lines dt i+1 lw 2 \
     lc rgb word(orange." ".green." ".purple, i) title "k = ".word("1 3 5", i), \
     "" using 1:5 skip 1 with lines lw 1.5 lc rgb black title "converged"
unset multiplot
