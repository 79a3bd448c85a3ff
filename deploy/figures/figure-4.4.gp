# SPDX-License-Identifier: Apache-2.0
# The hard data: the iteration and implicit Euler with three steps each.
load directory."/style.gp"
set multiplot layout 2,2
set xlabel "t"
set xrange [0:1]
set ytics 0.5
set yrange [-0.05:1.2]
do for [method in "iteration euler"] {
  do for [column in "6 8"] {
    if (column eq "6") { set key top right } else { unset key }
    set title (method eq "iteration" ? "iteration" : "implicit Euler")
    set ylabel (column eq "6" ? "y_2" : "y_4")
    plot "4.4-".method."-8.csv" using 1:int(column) skip 1 with lines lw 2 lc rgb black title "h = 2^{−8}", \
         "4.4-".method."-7.csv" using 1:int(column) skip 1 with lines dt 2 lw 2 lc rgb blue title "h = 2^{−7}", \
         "4.4-".method."-6.csv" using 1:int(column) skip 1 with lines dt 4 lw 3 lc rgb orange title "h = 2^{−6}"
  }
}
unset multiplot
