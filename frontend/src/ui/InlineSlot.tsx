import type { ReactNode } from "react";

const PLACE = "\u{FFFC}";

/** A sentence around something that is no text, such as a link: wherever in the sentence each language has it. */
export function InlineSlot(props: { words: (it: string) => string; children: ReactNode }) {
  const [before, after] = props.words(PLACE).split(PLACE);
  return (
    <>
      {before}
      {props.children}
      {after}
    </>
  );
}
