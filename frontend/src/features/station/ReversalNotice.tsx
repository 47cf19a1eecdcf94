import { Alert, Text } from "@mantine/core";
import { IconArrowBackUpDouble } from "@tabler/icons-react";
import type { Live, Schemas } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { translateServerText } from "../../lib/serverText";
import { InlineSlot } from "../../ui/InlineSlot";

/** Return the state on the recording's path in words that can be read from two metres. */
export function describePath(mode: Live["mode"], run: Schemas["RunLive"]): string {
  if (mode === "playing")
    return run.reversing ? t("station:reversal.reversing") : t("station:reversal.playing");
  if (run.reversing) return t("station:reversal.heldAfterReversal");
  return run.at_start ? t("station:reversal.atStart") : t("station:reversal.paused");
}

/** Shows where the arm met resistance, how often it was taken back, and what the operator can do. */
export function ReversalNotice({ mode, run }: { mode: Live["mode"]; run: Schemas["RunLive"] }) {
  if (run.reversals === 0) return null;
  const waits = mode === "paused" && run.reversing;
  const title = (
    <Text inherit fz="lg">
      {t("station:reversal.times", { count: run.reversals })}
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
          {t("station:reversal.checkPatient")}
          <InlineSlot words={(button) => t("station:reversal.playOn", { button })}>
            <b>{t("station:play.playOn")}</b>
          </InlineSlot>
          <InlineSlot words={(button) => t("station:reversal.return", { button })}>
            <b>{t("station:play.returnAndRelease")}</b>
          </InlineSlot>
          <InlineSlot words={(button) => t("station:reversal.stop", { button })}>
            <b>{t("common:stop.stop")}</b>
          </InlineSlot>
        </Text>
      )}
    </Alert>
  );
}
