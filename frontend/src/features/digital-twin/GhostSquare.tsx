import { Text } from "@mantine/core";
import { SCENE_COLOURS } from "./colours";
import { useScheme } from "./useScheme";

const SQUARE = "■";

/** A square in the ghost's colour, for a legend. */
export function GhostSquare() {
  return (
    <Text span c={SCENE_COLOURS[useScheme()].ghost} inherit aria-hidden>
      {SQUARE}
    </Text>
  );
}
