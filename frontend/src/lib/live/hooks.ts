import { useQueryClient } from "@tanstack/react-query";
import { useEffect, useState, useSyncExternalStore } from "react";
import type { CommandName, Live, Schemas, StationInfo } from "../api/client";
import { t } from "../i18n";
import { translateServerText } from "../serverText";
import { ageTenths, isAlive, type LiveState, store } from "./store";

const AGE_UPDATE_MS = 500;

function useStore<T>(select: (state: LiveState) => T): T {
  return useSyncExternalStore(store.subscribe, () => select(store.get()));
}

/** True while messages from the service arrive. */
export const useConnected = (): boolean => useStore((state) => state.connected);

/** Return true while the shown values are current. While it is false, no value may look current. */
export const useAlive = (): boolean => useStore(isAlive);

/**
 * Return the age of the shown state in tenths of a second: the device's own age plus the transport time. Return
 * null without data.
 */
export function useAge(): number | null {
  const [age, setAge] = useState<number | null>(null);
  useEffect(() => {
    const update = () => setAge(ageTenths(store.get(), Date.now()));
    update();
    const timer = setInterval(update, AGE_UPDATE_MS);
    return () => clearInterval(timer);
  }, []);
  return age;
}

export const useHeardAt = (): number | null =>
  useStore((state) => (state.heardAt === null ? null : Math.floor(state.heardAt / 1000) * 1000));

/** Return the events since this page was opened, newest first. */
export const useEvents = (): Schemas["EventLive"][] => useStore((state) => state.events);

export const useStation = (): StationInfo | null => useStore((state) => state.station);

/** One field of the live state, or null without data. */
export function useLive<Name extends keyof Live>(name: Name): Live[Name] | null {
  return useStore((state) => state.live?.[name] ?? null);
}

/** Return the reason why a command is not possible, or null if it is possible. */
export function useRefusal(
  command: CommandName,
): Pick<Schemas["RefusalLive"], "code" | "message" | "next_step"> | null {
  const alive = useAlive();
  const refusal = useStore((state) => state.live?.refusals[command] ?? null);
  if (!alive) {
    return {
      code: "not_alive",
      message: t("common:notAlive.message"),
      next_step: t("common:notAlive.nextStep"),
    };
  }
  return (
    refusal && {
      code: refusal.code,
      message: translateServerText(refusal.message, refusal.message_key),
      next_step: translateServerText(refusal.next_step, refusal.next_step_key),
    }
  );
}

/** Refresh lists when a recording or a run is saved, and when the connection returns: one may have been saved meanwhile. */
export function useSavedRecords(): void {
  const queries = useQueryClient();
  useEffect(() => {
    const refresh = (...lists: string[]) => {
      for (const list of lists) void queries.invalidateQueries({ queryKey: [list] });
    };
    const stopListening = [
      store.onSaved(({ what }) =>
        refresh(...(what === "recording" ? ["recordings"] : []), "session", "sessions"),
      ),
      store.onReconnected(() => refresh("recordings", "session", "sessions")),
    ];
    return () => {
      for (const stop of stopListening) stop();
    };
  }, [queries]);
}
