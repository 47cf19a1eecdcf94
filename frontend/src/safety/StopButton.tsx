import { Button, Stack, Text } from "@mantine/core";
import { IconHandStop } from "@tabler/icons-react";
import { useCallback, useEffect, useState } from "react";
import { api, type Live, ProblemError } from "../lib/api/client";
import { formatClock } from "../lib/format";
import { store } from "../lib/live/store";
import { STOP } from "../lib/messages";
import { isMoving } from "./modes";

type Sent = { state: "sending" } | { state: "confirmed"; at: number } | { state: "failed"; why: string };

/** Whether Esc means Stop now: while something moves, or while nobody can say that nothing does. */
export function escapeStops(connected: boolean, mode: Live["mode"] | undefined): boolean {
  return !connected || mode === undefined || isMoving(mode);
}

/** Over the live connection, which stands already; by a request of its own where nothing is answered there. */
async function askForStop(): Promise<void> {
  const answer = await store.stop();
  if (answer === null) return await api.stop();
  if (answer.refusal) {
    const { code, message, next_step } = answer.refusal;
    throw new ProblemError({ code, detail: message, next_step });
  }
}

/** One press, no dialog, on every page; tells whether the device has confirmed it. */
export function StopButton() {
  const [sent, setSent] = useState<Sent | null>(null);

  const stop = useCallback(async () => {
    setSent({ state: "sending" });
    try {
      await askForStop();
      setSent({ state: "confirmed", at: Date.now() });
    } catch (error) {
      setSent({ state: "failed", why: error instanceof ProblemError ? error.message : STOP.noAnswer });
    }
  }, []);

  useEffect(() => {
    const onKey = (event: KeyboardEvent) => {
      const { connected, live } = store.get();
      if (event.key !== "Escape" || event.repeat || !escapeStops(connected, live?.mode)) return;
      event.preventDefault();
      event.stopPropagation();
      void stop();
    };
    // Before any dialog or input gets to see the key.
    window.addEventListener("keydown", onKey, { capture: true });
    return () => window.removeEventListener("keydown", onKey, { capture: true });
  }, [stop]);

  return (
    <Stack gap={2} align="center">
      <Button
        color="red.8"
        h={88}
        w={176}
        fz={28}
        radius="md"
        leftSection={<IconHandStop size={32} />}
        onClick={() => void stop()}
        aria-keyshortcuts="Escape"
        title={STOP.what}
      >
        {STOP.stop}
      </Button>
      <Text size="xs" h={18} aria-live="assertive" data-testid="stop-answer">
        {sent?.state === "sending" && STOP.sent}
        {sent?.state === "confirmed" && STOP.confirmed(formatClock(sent.at))}
        {sent?.state === "failed" && STOP.failed(sent.why)}
        {!sent && STOP.key}
      </Text>
    </Stack>
  );
}
