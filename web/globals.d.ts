// The vendored libraries stand in the page as global names.
import type uPlotClass from "uplot";
import type * as ThreeModule from "three";
import type { OrbitControls as Controls } from "three/examples/jsm/controls/OrbitControls.js";
import type * as CodeMirror from "./codemirror_entry.js";

declare global {
  const CM: typeof CodeMirror;
  type Editor = CodeMirror.EditorView;
  const uPlot: typeof uPlotClass;
  const THREE: typeof ThreeModule & { OrbitControls: typeof Controls };
  type Plot = uPlotClass;
  type PlotOptions = Omit<uPlotClass.Options, "width">;
  type PlotData = uPlotClass.AlignedData;
  type PlotAxis = uPlotClass.Axis;
}
