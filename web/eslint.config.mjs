import js from "@eslint/js";
import globals from "globals";

export default [
  { ignores: ["web/node_modules/"] },
  js.configs.recommended,
  {
    files: ["exugear/report/web/scripts/*.js"],
    languageOptions: {
      ecmaVersion: 2022,
      sourceType: "module",
      globals: { ...globals.browser, uPlot: "readonly", THREE: "readonly", CM: "readonly" },
    },
    rules: {
      "no-restricted-properties": [
        "error",
        ...["innerHTML", "outerHTML", "insertAdjacentHTML"].map((property) => ({
          property,
          message: "Names come from strangers: put them in as text.",
        })),
        { object: "document", property: "write", message: "Names come from strangers: put them in as text." },
      ],
      "no-eval": "error",
      "no-implied-eval": "error",
      "no-new-func": "error",
      "prefer-const": "error",
      eqeqeq: "error",
      "max-lines": ["error", { max: 300 }],
      "max-lines-per-function": ["error", { max: 80 }],
    },
  },
  {
    files: ["web/*.mjs", "web/*_entry.js"],
    languageOptions: { sourceType: "module", globals: globals.node },
  },
];
