import { parseAst } from "vite";

const START =
  /^\s*\/\*\*[\s\S]*?\*\/\s*\(\s*function\(root, factory\) \{[\s\S]*?\} \(typeof self[^,]*, \(\) => \{\s*/;
const END = /\s*window\.Plotly = Plotly;\s*return Plotly;\s*\}\)\);?\s*$/;
/** Fewer parts mean that the file is written in a way that this module does not read. */
const LEAST_PARTS = 300;

/**
 * Return Plotly's file as a module of its own, without the function around all of it, and with parentheses around
 * the function of each of its parts.
 *
 * A browser compiles a function when it is called, and the page does not react meanwhile, unless the function is in
 * parentheses: then the browser compiles it in another thread while it loads the file.
 */
export function unwrapPlotly(source: string): string {
  if (!START.test(source) || !END.test(source)) throw new Error("Plotly's file has no known start or end.");
  const unwrapped = `${source.replace(START, "").replace(END, "")}\nexport default Plotly;\n`;
  const parts = partsOf(unwrapped);
  if (parts.length < LEAST_PARTS) throw new Error(`Plotly's file has ${parts.length} known parts.`);
  let end = 0;
  const pieces = parts.map(([start, partEnd]) => {
    const piece = `${unwrapped.slice(end, start)}(${unwrapped.slice(start, partEnd)})`;
    end = partEnd;
    return piece;
  });
  return pieces.join("") + unwrapped.slice(end);
}

/** Return the start and end of the function of each part: `var Part = wrapper((exports, module) => { ... })`. */
function partsOf(source: string): [number, number][] {
  const plotly = parseAst(source).body.find((statement) => statement.type === "VariableDeclaration");
  const call = plotly?.declarations[0]?.init;
  let around = call?.type === "CallExpression" ? call.callee : null;
  while (around?.type === "ParenthesizedExpression") around = around.expression;
  if (around?.type !== "ArrowFunctionExpression" || around.body.type !== "BlockStatement") return [];
  return around.body.body.flatMap((statement) =>
    statement.type !== "VariableDeclaration"
      ? []
      : statement.declarations.flatMap(({ init }): [number, number][] => {
          const part = init?.type === "CallExpression" ? init.arguments[0] : null;
          return part?.type === "ArrowFunctionExpression" ? [[part.start, part.end]] : [];
        }),
  );
}
