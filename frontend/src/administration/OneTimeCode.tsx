import { Button, CopyButton, Group, Stack, Text } from "@mantine/core";
import { IconCheck, IconCopy } from "@tabler/icons-react";
import type { Schemas } from "../api/client";
import { formatMoment } from "../shared/format";

/** It is shown once, to be handed over. */
export function OneTimeCode({ given, onDone }: { given: Schemas["OneTimeCode"]; onDone: () => void }) {
  const link = `${location.origin}/set-password#code=${encodeURIComponent(given.code)}`;
  return (
    <Stack>
      <Text>
        Hand this over to whoever it is for, and to nobody else. It is good once, until{" "}
        {formatMoment(given.until)}, and is not shown again.
      </Text>
      <Text>
        User name:{" "}
        <Text span fw={600} data-testid="username">
          {given.account.username}
        </Text>
      </Text>
      <Text>
        One-time code:{" "}
        <Text span fw={600} ff="monospace" fz="lg" data-testid="code" style={{ overflowWrap: "anywhere" }}>
          {given.code}
        </Text>
      </Text>
      <Text size="sm">It is typed at “I have a one-time code” on the sign-in page, or opened as a link.</Text>
      <Group>
        <CopyButton value={link}>
          {({ copied, copy }) => (
            <Button
              variant="default"
              leftSection={copied ? <IconCheck size={20} /> : <IconCopy size={20} />}
              onClick={copy}
            >
              {copied ? "Copied" : "Copy the link"}
            </Button>
          )}
        </CopyButton>
        <Button onClick={onDone}>I have handed it over</Button>
      </Group>
    </Stack>
  );
}
