/**
 * What each schedule file is for; `everywhere`: it needs a number at every point.
 * @type {Object<string, {title: string, purpose: string, everywhere: boolean}>}
 */
export const FORMATS = {
  json: { title: "JSON", purpose: "The whole schedule for any program: axes, gains, units, outcomes, law and provenance.", everywhere: false },
  csv: { title: "Table", purpose: "One row a grid point, for spreadsheets and for reading by eye.", everywhere: false },
  mat: { title: "MATLAB data", purpose: "Arrays over the grid for load in MATLAB or scipy.io.loadmat in Python.", everywhere: false },
  npz: { title: "NumPy arrays", purpose: "Arrays over the grid for numpy.load.", everywhere: false },
  h5: { title: "HDF5", purpose: "The whole schedule with its attributes, for h5py, MATLAB's h5read and other HDF5 readers.", everywhere: false },
  h: { title: "C header", purpose: "Declarations to compile beside the C source, C99 without an allocation.", everywhere: true },
  c: { title: "C source", purpose: "Tables, interpolation and a self-test for embedded code; goes with the header.", everywhere: true },
  m: { title: "MATLAB script", purpose: "The tables as variables of MATLAB and Octave, and as lookup-table objects where Simulink is there.", everywhere: true },
  xml: { title: "JSBSim system", purpose: "The gains looked up in flight, as a system of a JSBSim aircraft.", everywhere: true },
  dml: { title: "DAVE-ML", purpose: "Gridded tables with units and check cases, for tools that exchange flight models.", everywhere: true },
};
