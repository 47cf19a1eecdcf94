import { Button, type ButtonProps, Text } from "@mantine/core";
import { useMutation } from "@tanstack/react-query";
import { type ReactNode, useId } from "react";
import type { CommandName } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { useRefusal } from "../../lib/live/hooks";
import { store } from "../../lib/live/store";
import hold from "../../safety/hold.module.css";
import { useHold } from "../../safety/useHold";
import { ProblemNote } from "../../ui/ProblemNote";
import { useMayOperate } from "../auth/hooks";
import classes from "./station.module.css";

type Props = ButtonProps & {
  command: CommandName;
  /** `released` aborts when a held button is released. */
  send: (released: AbortSignal) => Promise<unknown>;
  onDone?: () => void;
  /** True if the user must hold the button for one second instead of pressing it. */
  held?: boolean;
  /** How long to hold the button, if not for one second. */
  hint?: string;
  children: ReactNode;
};

/**
 * A button that sends a command to the apparatus. The service decides whether the command is possible; the
 * button shows the reason if it is not. After a press the button waits until the apparatus has confirmed the
 * command and the page shows the new state.
 */
export function CommandButton({
  command,
  send,
  onDone,
  held = false,
  hint: ownHint,
  children,
  disabled,
  ...look
}: Props) {
  const operates = useMayOperate();
  const refusal = useRefusal(command);
  const about = useId();
  const sending = useMutation({
    mutationFn: async (released: AbortSignal) => {
      await send(released);
      await store.waitForFreshState();
    },
    ...(onDone && { onSuccess: onDone }),
  });
  const waits = sending.isPending;
  const possible = refusal === null && disabled !== true;
  const { holding, handlers } = useHold(possible && !waits, String(command), sending.mutate);
  if (!operates) return null;
  const hint = held
    ? holding === "again"
      ? t("station:station.pressAgain")
      : (ownHint ?? t("station:station.holdToMove"))
    : "";
  return (
    <div>
      <Button
        size="xl"
        {...look}
        loading={waits}
        disabled={!possible}
        aria-describedby={about}
        {...(held
          ? { ...handlers, className: hold.held ?? "", "data-holding": holding }
          : { onClick: () => sending.mutate(AbortSignal.abort()) })}
      >
        {children}
      </Button>
      <Text size="sm" maw={320} id={about} className={waits ? (classes.waits ?? "") : ""}>
        {waits
          ? t("station:station.waitingForApparatus")
          : refusal
            ? `${refusal.message} ${refusal.next_step}`
            : hint}
      </Text>
      {sending.error && (
        <Text component="div" mt="xs">
          <ProblemNote error={sending.error} marksFields={false} />
        </Text>
      )}
    </div>
  );
}
