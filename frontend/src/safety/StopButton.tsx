import { Button, Text } from "@mantine/core";
import { IconHandStop } from "@tabler/icons-react";
import { useCallback, useEffect, useRef, useState } from "react";
import { api, type Live, ProblemError } from "../lib/api/client";
import { formatClock } from "../lib/format";
import { t } from "../lib/i18n";
import { store } from "../lib/live/store";
import { isMoving } from "./modes";
import classes from "./StopButton.module.css";
import { useTabFromDialog } from "./useTabFromDialog";

type StopProgress =
  | { state: "sending" }
  | { state: "confirmed"; at: number }
  | { state: "failed"; reason: string };

type KnownState = Pick<Live, "mode"> & { refusals?: Live["refusals"] };

/**
 * Return true if Esc triggers Stop: while something moves, while a technician commissions the station, or while
 * the state is unknown.
 */
export function escapeStops(connected: boolean, live: KnownState | null): boolean {
  const commissioned = live?.refusals?.teach?.code === "commissioning_runs";
  return !connected || live === null || isMoving(live.mode) || commissioned;
}

/** Send Stop over the live connection. If it is not answered there, send it by a separate request. */
async function requestStop(): Promise<void> {
  const answer = await store.stop();
  if (answer === null) return await api.stop();
  if (answer.refusal) {
    const { code, message, message_key = null, next_step, next_step_key = null } = answer.refusal;
    throw new ProblemError({ code, detail: message, detail_key: message_key, next_step, next_step_key });
  }
}

/**
 * The Stop button of every page. It needs one press and no dialog. It shows whether the device has confirmed
 * the Stop.
 */
export function StopButton() {
  const [progress, setProgress] = useState<StopProgress | null>(null);
  const button = useRef<HTMLButtonElement>(null);
  useTabFromDialog(button);

  const stop = useCallback(async () => {
    setProgress({ state: "sending" });
    try {
      await requestStop();
      setProgress({ state: "confirmed", at: Date.now() });
    } catch (error) {
      setProgress({
        state: "failed",
        reason: error instanceof ProblemError ? error.message : t("common:stop.noAnswer"),
      });
    }
  }, []);

  useEffect(() => {
    const onKey = (event: KeyboardEvent) => {
      const { connected, live } = store.get();
      if (event.key !== "Escape" || event.repeat || !escapeStops(connected, live)) return;
      event.preventDefault();
      event.stopPropagation();
      void stop();
    };
    // Handled in the capture phase, before a dialog or an input handles the key.
    window.addEventListener("keydown", onKey, { capture: true });
    return () => window.removeEventListener("keydown", onKey, { capture: true });
  }, [stop]);

  return (
    <div className={classes.stop}>
      <Button
        ref={button}
        color="red.8"
        h="var(--height)"
        w="var(--width)"
        px="var(--sides)"
        fz="var(--letters)"
        radius="md"
        leftSection={<IconHandStop size={32} />}
        onClick={() => void stop()}
        aria-keyshortcuts="Escape"
        title={t("common:stop.what")}
      >
        {t("common:stop.stop")}
      </Button>
      <Text
        size="xs"
        className={classes.answer ?? ""}
        aria-live="assertive"
        data-testid="stop-answer"
        data-state={progress?.state ?? "none"}
      >
        {progress?.state === "sending" && t("common:stop.sent")}
        {progress?.state === "confirmed" && t("common:stop.confirmed", { time: formatClock(progress.at) })}
        {progress?.state === "failed" && t("common:stop.failed", { why: progress.reason })}
        {!progress && t("common:stop.key")}
      </Text>
    </div>
  );
}
