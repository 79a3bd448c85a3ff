# SPDX-License-Identifier: Apache-2.0
# Iterates 1, 2 and 4 of the small example beside the converged solution, h = 2^-7.
load directory."/style.gp"
set multiplot layout 2,3
set xlabel "t"
set xrange [0:1]
columns = "2 3 4 6 8"
names = "x_1 x_2 x_3 y_2 y_4"
unset key
set bmargin -1
do for [i=1:5] {
  column = int(word(columns, i))
  set ylabel word(names, i)
  plot "4.2-1.csv" using 1:column skip 1 with lines dt 3 lw 2 lc rgb orange title "k = 1", \
       "4.2-2.csv" using 1:column skip 1 with lines dt 4 lw 2 lc rgb green title "k = 2", \
       "4.2-4.csv" using 1:column skip 1 with lines dt 2 lw 2 lc rgb purple title "k = 4", \
       "4.2-converged.csv" using 1:column skip 1 with lines lw 1.5 lc rgb black title "converged"
}
# The legend has the last panel for itself.
unset border; unset tics; unset grid; unset xlabel; unset ylabel
set key center center samplen 4 spacing 1.6
set yrange [0:1]
plot NaN with lines dt 3 lw 2 lc rgb orange title "k = 1", NaN with lines dt 4 lw 2 lc rgb green title "k = 2", \
     NaN with lines dt 2 lw 2 lc rgb purple title "k = 4", NaN with lines lw 1.5 lc rgb black title "converged"
unset multiplot
