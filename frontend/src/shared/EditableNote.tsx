import { Button, Group, Stack, Textarea } from "@mantine/core";
import { useMutation } from "@tanstack/react-query";
import { useState } from "react";
import { ProblemNote } from "./problem";

/** A note that is saved when one says so, and shows while it is not. */
export function EditableNote(props: {
  label: string;
  value: string;
  save: (note: string) => Promise<unknown>;
}) {
  const [draft, setDraft] = useState<string | null>(null);
  const saving = useMutation({ mutationFn: props.save, onSuccess: () => setDraft(null) });
  const changed = draft !== null && draft !== props.value;
  return (
    <Stack gap="xs">
      <Textarea
        label={props.label}
        autosize
        minRows={2}
        value={draft ?? props.value}
        onChange={(event) => setDraft(event.currentTarget.value)}
      />
      {changed && (
        <Group>
          <Button loading={saving.isPending} onClick={() => saving.mutate(draft)}>
            Save note
          </Button>
          <Button variant="subtle" onClick={() => setDraft(null)}>
            Discard
          </Button>
        </Group>
      )}
      <ProblemNote error={saving.error} />
    </Stack>
  );
}
