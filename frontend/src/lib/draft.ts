import { type Dispatch, type SetStateAction, useCallback, useState } from "react";

/** Unsaved input by form and field. A reload discards it. */
const drafts = new Map<string, unknown>();

/** Discard the drafts whose key starts with `form`, or all of them. */
export function forgetDrafts(form = ""): void {
  for (const key of [...drafts.keys()]) if (key.startsWith(form)) drafts.delete(key);
}

/**
 * Return a field's state that is kept when the field is unmounted, for example by the lock screen, a closed
 * dialog or another page. `key` names the form, the record and its version, so that input based on an old
 * version is not applied to a newer one.
 */
export function useDraft<Value>(
  key: string,
  initial: Value | (() => Value),
): [Value, Dispatch<SetStateAction<Value>>] {
  const [initialKey] = useState(key);
  const [value, setValue] = useState<Value>(() =>
    drafts.has(initialKey)
      ? (drafts.get(initialKey) as Value)
      : initial instanceof Function
        ? initial()
        : initial,
  );
  const setDraft = useCallback<Dispatch<SetStateAction<Value>>>(
    (next) =>
      setValue((previous) => {
        const updated = next instanceof Function ? next(previous) : next;
        drafts.set(initialKey, updated);
        return updated;
      }),
    [initialKey],
  );
  return [value, setDraft];
}
