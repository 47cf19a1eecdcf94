import { Text } from "@mantine/core";
import { SCENE_COLOURS } from "./colours";
import { useScheme } from "./useScheme";

/** With a no-break space, so that the text stays beside it. */
const SQUARE = "■\u00a0";

/** A square in the ghost's colour, before a text of a legend. */
export function GhostSquare() {
  return (
    <Text span c={SCENE_COLOURS[useScheme()].ghost} inherit aria-hidden>
      {SQUARE}
    </Text>
  );
}
