import { Alert, Text } from "@mantine/core";
import { IconArrowBackUpDouble } from "@tabler/icons-react";
import type { Live, Schemas } from "../api/client";

/** What goes on on the recording's path, to be read from two metres. */
export function pathWords(mode: Live["mode"], run: Schemas["RunLive"]): string {
  if (mode === "playing") return run.reversing ? "Taking the arm back" : "Playing";
  if (run.reversing) return "Taken back, holding";
  return run.at_start ? "At the start, holding" : "Paused, holding";
}

function timesWords(count: number): string {
  return count === 1 ? "once" : `${count} times`;
}

/** Where the arm met resistance, how often it was taken back, and what can be done while it waits. */
export function TakenBack({ mode, run }: { mode: Live["mode"]; run: Schemas["RunLive"] }) {
  if (run.reversals === 0) return null;
  const waits = mode === "paused" && run.reversing;
  const title = (
    <Text inherit fz="lg">
      Taken back {timesWords(run.reversals)} in this playback
    </Text>
  );
  return (
    <Alert
      color="grape"
      variant={run.reversing ? "light" : "outline"}
      icon={<IconArrowBackUpDouble />}
      title={title}
      role="status"
      data-testid="taken-back"
    >
      <Text>{run.resistance}</Text>
      {waits && (
        <Text mt="xs">
          Look after the patient first. <b>Play on</b> tries again from here; resistance in the same place
          again stops the playback. <b>Back and release</b> takes the arm to where it came from. <b>Stop</b>{" "}
          lets it go here.
        </Text>
      )}
    </Alert>
  );
}
