import { Button, Group, Stack, Textarea } from "@mantine/core";
import { useMutation } from "@tanstack/react-query";
import { useState } from "react";
import { useHasPermission } from "../features/auth/hooks";
import { NOTES } from "../lib/messages";
import { ProblemNote } from "./ProblemNote";

/** A note that is saved when one says so, and shows while it is not. */
export function EditableNote(props: {
  label: string;
  value: string;
  /** Of the record that it stands in; given back with the note as it was when the writing began. */
  version?: string;
  save: (note: string, seen: string | null) => Promise<unknown>;
}) {
  const writes = useHasPermission("write_records");
  const [draft, setDraft] = useState<string | null>(null);
  const [seen, setSeen] = useState<string | null>(null);
  const saving = useMutation({
    mutationFn: (note: string) => props.save(note, seen),
    onSuccess: () => setDraft(null),
  });
  const changed = draft !== null && draft !== props.value;
  const write = (text: string) => {
    // Somebody else's newer note may arrive meanwhile, and must not be taken for one that was read.
    if (draft === null) setSeen(props.version ?? null);
    setDraft(text);
  };
  return (
    <Stack gap="xs">
      <Textarea
        label={props.label}
        autosize
        minRows={2}
        readOnly={!writes}
        value={draft ?? props.value}
        onChange={(event) => write(event.currentTarget.value)}
      />
      {changed && (
        <Group>
          <Button loading={saving.isPending} onClick={() => saving.mutate(draft)}>
            {NOTES.save}
          </Button>
          <Button variant="subtle" onClick={() => setDraft(null)}>
            {NOTES.discard}
          </Button>
        </Group>
      )}
      <ProblemNote error={saving.error} />
    </Stack>
  );
}
