import { Button, CopyButton, Group, Stack, Text } from "@mantine/core";
import { IconCheck, IconCopy } from "@tabler/icons-react";
import type { Schemas } from "../../lib/api/client";
import { formatMoment } from "../../lib/format";
import { CODE } from "./messages";

/** A one-time code, shown once for handing over. */
export function OneTimeCode({ code, onDone }: { code: Schemas["OneTimeCode"]; onDone: () => void }) {
  const link = `${location.origin}/set-password#code=${encodeURIComponent(code.code)}`;
  return (
    <Stack>
      <Text>{CODE.handOver(formatMoment(code.until))}</Text>
      <Text>
        {CODE.username}{" "}
        <Text span fw={600} data-testid="username">
          {code.account.username}
        </Text>
      </Text>
      <Text>
        {CODE.code}{" "}
        <Text span fw={600} ff="monospace" fz="lg" data-testid="code" style={{ overflowWrap: "anywhere" }}>
          {code.code}
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
