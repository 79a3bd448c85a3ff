// SPDX-License-Identifier: Apache-2.0
// Colors of plots, for light and dark. They differ by at least 3:1 from the background.

const scheme = matchMedia('(prefers-color-scheme: dark)');

const lines = {
  light: ['#1a5fd0', '#c2410c', '#15803d', '#8b2fc9', '#0e7490', '#b91c1c', '#8a5a00', '#be185d'],
  dark: ['#7ab0ff', '#ff9f5f', '#5fd38d', '#cd9bff', '#4dd0e1', '#ff8585', '#e0b84c', '#ff8ac4'],
};

export function lineColor(i: number): string {
  const colors = scheme.matches ? lines.dark : lines.light;
  return colors[i % colors.length];
}

export interface PlotColors {
  text: string;
  grid: string;
  marker: string;
}

export function plotColors(): PlotColors {
  return scheme.matches
    ? {text: '#c3cad6', grid: '#333b48', marker: '#8f99a8'}
    : {text: '#3d4754', grid: '#e3e7ec', marker: '#747f8d'};
}

export function onThemeChange(change: () => void, signal: AbortSignal): void {
  scheme.addEventListener('change', change, {signal});
}

// Points of the color map viridis, from the smallest to the largest value.
const map = [
  [68, 1, 84],
  [71, 44, 122],
  [59, 81, 139],
  [44, 113, 142],
  [33, 144, 141],
  [39, 173, 129],
  [92, 200, 99],
  [170, 220, 50],
  [253, 231, 37],
];

/** Red, green and blue of a value from 0 to 1. */
export function mapColor(value: number): [number, number, number] {
  const place = Math.min(Math.max(value, 0), 1) * (map.length - 1);
  const from = Math.min(Math.floor(place), map.length - 2);
  const part = place - from;
  return [0, 1, 2].map((c) => Math.round(map[from][c] + part * (map[from + 1][c] - map[from][c]))) as [
    number,
    number,
    number,
  ];
}
