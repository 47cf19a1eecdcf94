import { Alert, Text } from "@mantine/core";
import { IconArrowBackUpDouble } from "@tabler/icons-react";
import type { Live, Schemas } from "../../lib/api/client";
import { STOP } from "../../lib/messages";
import { translateServerText } from "../../lib/serverText";
import { InlineSlot } from "../../ui/InlineSlot";
import { PLAY, TAKEN_BACK } from "./messages";

/** Describe the state on the recording's path, readable from two metres. */
export function pathWords(mode: Live["mode"], run: Schemas["RunLive"]): string {
  if (mode === "playing") return run.reversing ? TAKEN_BACK.reversing : TAKEN_BACK.playing;
  if (run.reversing) return TAKEN_BACK.heldBack;
  return run.at_start ? TAKEN_BACK.atStart : TAKEN_BACK.paused;
}

/** Shows where the arm met resistance, how often it was taken back, and what the operator can do. */
export function ReversalNotice({ mode, run }: { mode: Live["mode"]; run: Schemas["RunLive"] }) {
  if (run.reversals === 0) return null;
  const waits = mode === "paused" && run.reversing;
  const title = (
    <Text inherit fz="lg">
      {TAKEN_BACK.times(run.reversals)}
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
      <Text>{translateServerText(run.resistance ?? "", run.resistance_key)}</Text>
      {waits && (
        <Text mt="xs">
          {TAKEN_BACK.look}
          <InlineSlot words={TAKEN_BACK.playOn}>
            <b>{PLAY.playOn}</b>
          </InlineSlot>
          <InlineSlot words={TAKEN_BACK.back}>
            <b>{PLAY.back}</b>
          </InlineSlot>
          <InlineSlot words={TAKEN_BACK.stop}>
            <b>{STOP.stop}</b>
          </InlineSlot>
        </Text>
      )}
    </Alert>
  );
}
