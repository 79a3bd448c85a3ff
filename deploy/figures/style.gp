# SPDX-License-Identifier: Apache-2.0
# What all figures share. `format` (svg or png), `name`, `width` and `height` come from the caller.
if (format eq "svg") set terminal svg size width,height font "DejaVu Sans,13" background rgb "white"
if (format eq "png") set terminal pngcairo size 1.5*width,1.5*height font "DejaVu Sans,13" fontscale 1.5 \
  linewidth 1.5 background rgb "white"
set output name.".".format
set datafile separator ","
set datafile missing ""
set border 3 linewidth 1
set tics nomirror out
set grid back linecolor rgb "#dddddd" linetype 1 linewidth 0.7
# Where curves leave room is for the figure to say.
set key inside vertical Left reverse samplen 2.5 spacing 1.1
set bmargin 4
unset mxtics; unset mytics
# The palette of Okabe and Ito, told apart with any color vision.
blue = "#0072b2"; orange = "#d55e00"; green = "#009e73"; purple = "#cc79a7"; sky = "#56b4e9"; black = "#222222"
