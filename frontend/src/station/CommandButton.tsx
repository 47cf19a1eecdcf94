import { Button, type ButtonProps, Text, Tooltip } from "@mantine/core";
import { useMutation } from "@tanstack/react-query";
import type { ReactNode } from "react";
import { useOperates } from "../access/hooks";
import type { CommandName } from "../api/client";
import { useRefusal } from "../live/hooks";
import { ProblemNote } from "../shared/problem";

type Props = ButtonProps & {
  command: CommandName;
  send: () => Promise<unknown>;
  onDone?: () => void;
  children: ReactNode;
};

/** One command to the apparatus. The service says whether it is possible now; the button only repeats why not. */
export function CommandButton({ command, send, onDone, children, disabled, ...look }: Props) {
  const operates = useOperates();
  const refusal = useRefusal(command);
  const sending = useMutation({ mutationFn: send, ...(onDone && { onSuccess: onDone }) });
  const why = refusal ? `${refusal.message} ${refusal.next_step}` : "";
  if (!operates) return null;
  return (
    <div>
      <Tooltip label={why} disabled={!refusal} multiline maw={320}>
        <Button
          size="xl"
          {...look}
          loading={sending.isPending}
          disabled={refusal !== null || disabled === true}
          onClick={() => sending.mutate()}
        >
          {children}
        </Button>
      </Tooltip>
      {sending.error && (
        <Text component="div" mt="xs">
          <ProblemNote error={sending.error} />
        </Text>
      )}
    </div>
  );
}
