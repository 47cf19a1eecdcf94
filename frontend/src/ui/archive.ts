import { useMutation } from "@tanstack/react-query";
import { t } from "../lib/i18n";
import { undoStore } from "./undo";

type Archivable = { name: string; archived_at: string | null };

/** Offer to restore an object that was just archived. */
export const offerRestore = (name: string, restore: () => Promise<unknown>) =>
  undoStore.offer({ words: t("ui:undo.archived", { name }), undo: restore });

/**
 * Return functions to archive and restore a record. Archiving can be undone. `save` stores a version of the
 * record and returns the next one.
 */
export function useArchive<Item extends Archivable>(
  item: Item,
  save: (archived: boolean, from: Item) => Promise<Item>,
) {
  return useMutation({
    mutationFn: (archived: boolean) => save(archived, item),
    onSuccess: (saved) => {
      if (saved.archived_at) offerRestore(saved.name, () => save(false, saved));
    },
  });
}
