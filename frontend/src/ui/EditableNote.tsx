import { Button, Group, Stack, Textarea } from "@mantine/core";
import { useMutation } from "@tanstack/react-query";
import { useState } from "react";
import { useHasPermission } from "../features/auth/hooks";
import { t } from "../lib/i18n";
import { ProblemNote } from "./ProblemNote";

/** A note that is saved on request and shows unsaved changes. */
export function EditableNote(props: {
  label: string;
  value: string;
  /** The record's version. `save` gets the version at which editing began. */
  version?: string;
  save: (note: string, seenVersion: string | null) => Promise<unknown>;
}) {
  const mayWrite = useHasPermission("write_records");
  const [draft, setDraft] = useState<string | null>(null);
  const [seenVersion, setSeenVersion] = useState<string | null>(null);
  const mutation = useMutation({
    mutationFn: (note: string) => props.save(note, seenVersion),
    onSuccess: () => setDraft(null),
  });
  const changed = draft !== null && draft !== props.value;
  const edit = (text: string) => {
    // A newer note may arrive during editing. The user has not seen it, so its version is not used.
    if (draft === null) setSeenVersion(props.version ?? null);
    setDraft(text);
  };
  return (
    <Stack gap="xs">
      <Textarea
        label={props.label}
        autosize
        minRows={2}
        readOnly={!mayWrite}
        value={draft ?? props.value}
        onChange={(event) => edit(event.currentTarget.value)}
      />
      {changed && (
        <Group>
          <Button loading={mutation.isPending} onClick={() => mutation.mutate(draft)}>
            {t("common:notes.save")}
          </Button>
          <Button variant="subtle" onClick={() => setDraft(null)}>
            {t("common:notes.discard")}
          </Button>
        </Group>
      )}
      <ProblemNote error={mutation.error} />
    </Stack>
  );
}
