import { Button, Group, List, Stack, Text, Title } from "@mantine/core";
import { useMutation } from "@tanstack/react-query";
import { AlarmFrame, useAlarms } from "../features/alarms/Alarms";
import { useMayOperate } from "../features/auth/hooks";
import { api, type Schemas } from "../lib/api/client";
import { useAlive, useLive, useRefusal } from "../lib/live/hooks";
import { store } from "../lib/live/store";
import { STOPPED } from "../lib/messages";
import { translateServerText } from "../lib/serverText";
import { ProblemNote } from "../ui/ProblemNote";
import hold from "./hold.module.css";
import { useHold } from "./useHold";

/**
 * A latched stop: why, what to do, and the acknowledgement once that is possible. A banner on every page; on the station's it is
 * `whole`, and stands in place of what one would do next. Without a live connection it is greyed and never more reassuring than before.
 */
export function StopBanner({ whole = false }: { whole?: boolean }) {
  const alive = useAlive();
  const operates = useMayOperate();
  const stop = useLive("stop");
  const alarm = useAlarms().find(({ code }) => code.startsWith("stop "));
  if (!stop) return null;
  const held = stop.arm_held;
  return (
    <AlarmFrame priority={alarm?.priority ?? "high"} testid="stop-banner">
      <div className={alive ? "" : "stale"}>
        <StopTitle whole={whole} held={held} />
        <Group justify="space-between" align="start" gap="xl">
          <List size={whole ? "xl" : "md"} spacing={4} flex="1 1 20rem">
            {!alive && <List.Item>{STOPPED.notKnownNext}</List.Item>}
            {stop.causes.map((cause) => (
              <List.Item key={`${cause.code}-${cause.axis}`}>
                <Text span inherit fw={600}>
                  {translateServerText(cause.message, cause.message_key)}
                </Text>{" "}
                {alive && cause.cleared && !held ? STOPPED.cleared : ""}
                {translateServerText(cause.next_step, cause.next_step_key)}
              </List.Item>
            ))}
          </List>
          {operates ? <Reset whole={whole} held={held} /> : <Text maw={320}>{STOPPED.byWhom}</Text>}
        </Group>
      </div>
    </AlarmFrame>
  );
}

function StopTitle({ whole, held }: { whole: boolean; held: boolean }) {
  const alive = useAlive();
  const torque = useLive("torque");
  const known = held ? (torque === "on" ? STOPPED.titleHeld : STOPPED.titleMayHold) : STOPPED.title;
  return (
    <Title order={2} fz={whole ? 36 : 20} mb="xs">
      {alive ? known : STOPPED.titleNotKnown}
    </Title>
  );
}

/** What ends a stop: first the torque of an arm that was found held, then the acknowledgement. */
function Reset({ whole, held }: { whole: boolean; held: boolean }) {
  const release = useRefusal("release_torque");
  const refusal = useRefusal("acknowledge");
  if (release === null) {
    return (
      <ResetButton
        whole={whole}
        held
        send={api.releaseTorque}
        refusal={null}
        next={STOPPED.releaseTorqueNext}
      >
        {STOPPED.releaseTorque}
      </ResetButton>
    );
  }
  return (
    <ResetButton
      whole={whole}
      held={held}
      send={api.acknowledge}
      refusal={refusal}
      next={held ? STOPPED.letsGo : STOPPED.startsNothing}
    >
      {held ? STOPPED.acknowledgeHeld : STOPPED.acknowledge}
    </ResetButton>
  );
}

type ResetProps = {
  whole: boolean;
  /** It lets an arm go: it takes a second's hold. */
  held: boolean;
  send: (seen: Schemas["SeenState"]) => Promise<unknown>;
  refusal: Schemas["RefusalLive"] | null;
  next: string;
  children: string;
};

function ResetButton({ whole, held, send, refusal, next, children }: ResetProps) {
  const sending = useMutation({ mutationFn: () => send(store.seen()) });
  const { holding, handlers } = useHold(held && refusal === null && !sending.isPending, () =>
    sending.mutate(),
  );
  const hint = held ? (holding === "again" ? STOPPED.again : STOPPED.hold) : "";
  return (
    <Stack gap={4}>
      <Button
        size={whole ? "xl" : "lg"}
        color="dark"
        disabled={refusal !== null}
        loading={sending.isPending}
        {...(held
          ? { ...handlers, className: hold.held ?? "", "data-holding": holding }
          : { onClick: () => sending.mutate() })}
      >
        {children}
      </Button>
      <Text size={whole ? "md" : "sm"} maw={320} mih={20} {...(held && { fw: 600 })}>
        {refusal ? refusal.message : [next, hint].filter(Boolean).join(" ")}
      </Text>
      <ProblemNote error={sending.error} />
    </Stack>
  );
}
