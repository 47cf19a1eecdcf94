import { useSyncExternalStore } from "react";
import type { Me } from "../../lib/api/client";
import { useStation } from "../../lib/live/hooks";
import { type AuthState, authStore } from "./authState";

export type Permission = Me["permissions"][number];

export const useStanding = (): AuthState => useSyncExternalStore(authStore.subscribe, authStore.get);

/** Whoever is signed in; null while nobody is, or the screen is locked. */
export function useMe(): Me | null {
  const standing = useStanding();
  return standing.is === "in" ? standing.me : null;
}

/** What is taught, found or signed bears this name; empty while nobody is signed in. */
export const useName = (): string => useMe()?.name ?? "";

/** Whether whoever is signed in may do it. The service says so, and refuses it to others whatever the page shows. */
export const useMay = (permission: Permission): boolean => useMe()?.permissions.includes(permission) ?? false;

/** Whether somebody works at a station; whoever is assigned to none works at all of them. */
export const worksAt = (me: Me, station: string): boolean =>
  me.stations.length === 0 || me.stations.includes(station);

/** Whether whoever is signed in may operate this station's apparatus. */
export function useOperates(): boolean {
  const me = useMe();
  const station = useStation();
  const operates = useMay("operate");
  return operates && me !== null && (station === null || worksAt(me, station.name));
}
