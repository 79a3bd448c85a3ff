// SPDX-License-Identifier: Apache-2.0
// All panels of a solve in their order.

import {h, oncePerFrame} from '../../dom';
import type {SolveData} from '../../solve/data';
import type {Trajectory} from '../../solve/trajectory';
import {AnalysisPanel} from './analysis';
import {CertificatePanel} from './certificate';
import {ConvergencePanel} from './convergence';
import {HeatMapPanel} from './heatmap';
import {MeasurementsPanel} from './measurements';
import type {Panel} from './panel';
import {TrajectoriesPanel} from './trajectories';
import {VerdictPanel} from './verdict';
import {WindowsPanel} from './windows';

export class Panels {
  readonly element: HTMLElement;
  private readonly trajectories: TrajectoriesPanel;
  private readonly panels: Panel[];
  /** Draws what is new, in the next frame. */
  readonly refresh: () => void;

  constructor(data: () => SolveData, onChoice: () => void, loadField: (() => Promise<Trajectory>) | null) {
    this.trajectories = new TrajectoriesPanel(onChoice);
    this.panels = [
      new VerdictPanel(),
      this.trajectories,
      new MeasurementsPanel(),
      new ConvergencePanel(),
      new WindowsPanel(),
      new HeatMapPanel(loadField),
      new AnalysisPanel(),
      new CertificatePanel(),
    ];
    this.element = h(
      'div',
      {class: 'panels'},
      this.panels.map((panel) => panel.element),
    );
    this.refresh = oncePerFrame(() => {
      const now = data();
      for (const panel of this.panels) panel.update(now);
    });
  }

  get chosen(): {states: number[]; pairs: number[]; outputs: number[]} {
    return this.trajectories.chosen;
  }

  destroy(): void {
    for (const panel of this.panels) panel.destroy?.();
  }
}
