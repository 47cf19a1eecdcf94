import type { ReactNode } from "react";

const MARKER = "\u{FFFC}";

/** A sentence with an element such as a link in it, at the position that each language needs. */
export function InlineSlot(props: { words: (it: string) => string; children: ReactNode }) {
  const [before, after] = props.words(MARKER).split(MARKER);
  return (
    <>
      {before}
      {props.children}
      {after}
    </>
  );
}
