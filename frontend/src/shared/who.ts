import { useSyncExternalStore } from "react";

const KEY = "kata.who";
const listeners = new Set<() => void>();

/** Who works here, as last said in this browser; empty while nobody has. What is taught, found or signed bears this name. */
export function useWho(): [string, (name: string) => void] {
  const name = useSyncExternalStore(
    (changed) => {
      listeners.add(changed);
      return () => listeners.delete(changed);
    },
    () => localStorage.getItem(KEY) ?? "",
  );
  return [name, say];
}

function say(name: string) {
  localStorage.setItem(KEY, name.trim());
  for (const changed of listeners) changed();
}
