import { type Dispatch, type SetStateAction, useCallback, useState } from "react";

/** What was typed and is not saved yet, by form and field; a page that is loaded again begins without. */
const drafts = new Map<string, unknown>();

/** Forget what was typed in the form whose fields begin with this: it has been saved or discarded. Without a form: everything. */
export function forgetDrafts(form = ""): void {
  for (const key of [...drafts.keys()]) if (key.startsWith(form)) drafts.delete(key);
}

/**
 * A field's state that outlives its form: the screen's lock, a dialog that is closed and a page that is left take nothing of it away. `key`
 * names form, record and the record's version: what was typed over an older version is not put over a newer one.
 */
export function useDraft<Value>(
  key: string,
  start: Value | (() => Value),
): [Value, Dispatch<SetStateAction<Value>>] {
  const [first] = useState(key);
  const [value, setValue] = useState<Value>(() =>
    drafts.has(first) ? (drafts.get(first) as Value) : start instanceof Function ? start() : start,
  );
  const change = useCallback<Dispatch<SetStateAction<Value>>>(
    (next) =>
      setValue((before) => {
        const after = next instanceof Function ? next(before) : next;
        drafts.set(first, after);
        return after;
      }),
    [first],
  );
  return [value, change];
}
