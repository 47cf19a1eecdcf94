import { Button, CloseButton, Group, Text } from "@mantine/core";
import { IconArrowBackUp } from "@tabler/icons-react";
import { useMutation } from "@tanstack/react-query";
import { useEffect, useSyncExternalStore } from "react";
import { t } from "../lib/i18n";
import { ProblemNote } from "./ProblemNote";
import classes from "./ui.module.css";
import { type Undoable, undoStore } from "./undo";

/** Offers to undo the last action, at the bottom of every page. */
export function UndoBar() {
  const offer = useSyncExternalStore(undoStore.subscribe, undoStore.get);
  // Cleared, because another user must not undo the action.
  useEffect(() => () => undoStore.clear(), []);
  return (
    <div role="status" className={classes.undo} data-testid="undo">
      {offer && <Offer key={offer.words} offer={offer} />}
    </div>
  );
}

function Offer({ offer }: { offer: Undoable }) {
  const undo = useMutation({ mutationFn: offer.undo, onSuccess: () => undoStore.clear() });
  return (
    <Group gap="sm" className={classes.offer}>
      <Text>{offer.words}</Text>
      <Button
        variant="default"
        leftSection={<IconArrowBackUp size={20} />}
        loading={undo.isPending}
        onClick={() => undo.mutate()}
      >
        {t("ui:undo.undo")}
      </Button>
      <CloseButton size={44} aria-label={t("ui:undo.close")} onClick={() => undoStore.clear()} />
      <ProblemNote error={undo.error} />
    </Group>
  );
}
