import { Button, CopyButton, Group, Stack, Text } from "@mantine/core";
import { IconCheck, IconCopy } from "@tabler/icons-react";
import type { Schemas } from "../../lib/api/client";
import { formatMoment } from "../../lib/format";
import { CODE } from "./messages";

/** It is shown once, to be handed over. */
export function OneTimeCode({ given, onDone }: { given: Schemas["OneTimeCode"]; onDone: () => void }) {
  const link = `${location.origin}/set-password#code=${encodeURIComponent(given.code)}`;
  return (
    <Stack>
      <Text>{CODE.handOver(formatMoment(given.until))}</Text>
      <Text>
        {CODE.username}{" "}
        <Text span fw={600} data-testid="username">
          {given.account.username}
        </Text>
      </Text>
      <Text>
        {CODE.code}{" "}
        <Text span fw={600} ff="monospace" fz="lg" data-testid="code" style={{ overflowWrap: "anywhere" }}>
          {given.code}
        </Text>
      </Text>
      <Text size="sm">{CODE.where}</Text>
      <Group>
        <CopyButton value={link}>
          {({ copied, copy }) => (
            <Button
              variant="default"
              leftSection={copied ? <IconCheck size={20} /> : <IconCopy size={20} />}
              onClick={copy}
            >
              {copied ? CODE.copied : CODE.copy}
            </Button>
          )}
        </CopyButton>
        <Button onClick={onDone}>{CODE.done}</Button>
      </Group>
    </Stack>
  );
}
