/** Matrices of a linear model as text of MATLAB or NumPy, every digit kept. */

const FORMS = {
  matlab: {
    comment: "%",
    matrix: (rows) => `[${rows.map((row) => row.join(", ")).join(";\n     ")}]`,
    names: (names) => `{${names.map((name) => `'${name}'`).join(", ")}}`,
    end: ";",
    first: [],
    last: ["plant = ss(A, B, C, D, 'StateName', states, 'InputName', inputs, 'OutputName', outputs);"],
  },
  numpy: {
    comment: "#",
    matrix: (rows) => `np.array([${rows.map((row) => `[${row.join(", ")}]`).join(",\n              ")}])`,
    names: (names) => `[${names.map((name) => `"${name}"`).join(", ")}]`,
    end: "",
    first: ["import numpy as np", ""],
    last: [],
  },
};

/**
 * A linear model as text.
 * @param {{A: number[][], B: number[][], C: number[][], D: number[][], states: string[], inputs: string[], outputs: string[]}} model SI and radians
 * @param {"matlab"|"numpy"} language
 * @param {Object<string, number>} coordinates of the point
 * @returns {string}
 */
export function matrixText(model, language, coordinates) {
  const form = FORMS[language];
  const where = Object.entries(coordinates).map(([name, value]) => `${name} = ${value}`).join(", ");
  const matrices = ["A", "B", "C", "D"].map((name) => `${name} = ${form.matrix(model[name])}${form.end}`);
  const names = ["states", "inputs", "outputs"].map((name) => `${name} = ${form.names(model[name])}${form.end}`);
  return [...form.first, `${form.comment} ${where}; SI and radians`, ...matrices, ...names, ...form.last].join("\n");
}
