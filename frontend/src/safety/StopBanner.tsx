import { Button, Group, List, Stack, Text, Title } from "@mantine/core";
import { useMutation } from "@tanstack/react-query";
import { useEffect, useId, useRef } from "react";
import { AlarmFrame, useAlarms } from "../features/alarms/Alarms";
import { useMayOperate } from "../features/auth/hooks";
import { api, type Schemas } from "../lib/api/client";
import { t } from "../lib/i18n";
import { useAlive, useLive, useRefusal } from "../lib/live/hooks";
import { store } from "../lib/live/store";
import { translateServerText } from "../lib/serverText";
import { ProblemNote } from "../ui/ProblemNote";
import hold from "./hold.module.css";
import { useHold } from "./useHold";

type Cause = Schemas["StopLive"]["causes"][number];

/**
 * A latched stop with its causes, next steps and the acknowledgement. Every page shows it as a banner, and
 * `fullPage` in large letters. Without a live connection the causes are greyed,
 * the instruction to support the arm stays readable, and nothing looks safer than with a connection.
 */
export function StopBanner({ fullPage }: { fullPage: boolean }) {
  const alive = useAlive();
  const mayOperate = useMayOperate();
  const stop = useLive("stop");
  const alarm = useAlarms().find(({ code }) => code.startsWith("stop "));
  const banner = useRef<HTMLDivElement>(null);
  const id = useId();
  // A user who has scrolled past the banner would not see it, nor a new cause in it.
  const causes = stop?.causes.length ?? 0;
  useEffect(() => {
    if (causes > 0) banner.current?.scrollIntoView({ block: "start" });
  }, [causes]);
  if (!stop) return null;
  const held = stop.arm_held;
  const several = causes > 1;
  return (
    <AlarmFrame priority={alarm?.priority ?? "high"} testid="stop-banner" ref={banner}>
      <StopTitle fullPage={fullPage} held={held} />
      <Group justify="space-between" align="start" gap="xl">
        <List fz={fullPage ? "clamp(1rem, 2.5vw, 1.25rem)" : "md"} spacing={4} flex="1 1 20rem">
          {!alive && <List.Item>{t("common:stopped.notKnownNext")}</List.Item>}
          {stop.causes.map((cause) => (
            <List.Item
              key={`${cause.code}-${cause.axis}`}
              id={causeId(id, cause)}
              {...(!alive && { c: "dimmed" })}
            >
              <Text span inherit fw={600}>
                {translateServerText(cause.message, cause.message_key)}
              </Text>{" "}
              {alive && cause.cleared && !held ? t("common:stopped.cleared") : ""}
              {alive && !cause.cleared && several ? t("common:stopped.notCleared") : ""}
              {translateServerText(cause.next_step, cause.next_step_key)}
            </List.Item>
          ))}
        </List>
        {mayOperate ? (
          <Reset fullPage={fullPage} stop={stop} id={id} />
        ) : (
          <Text maw={320}>{t("common:stopped.byWhom")}</Text>
        )}
      </Group>
    </AlarmFrame>
  );
}

function StopTitle({ fullPage, held }: { fullPage: boolean; held: boolean }) {
  const alive = useAlive();
  const torque = useLive("torque");
  const known = held
    ? torque === "on"
      ? t("common:stopped.titleHeld")
      : t("common:stopped.titleMayHold")
    : t("common:stopped.title");
  return (
    <Title order={2} fz={fullPage ? "clamp(1.5rem, 5vw, 2.25rem)" : 20} mb="xs">
      {alive ? known : t("common:stopped.titleNotKnown")}
    </Title>
  );
}

/** Return the id of a cause in the list of the banner with this id. */
const causeId = (id: string, { code, axis }: Cause) => `${id}-${code}-${axis}`;

/** The button for the next step of the reset: if an arm is held, first release the torque, then acknowledge. */
function Reset({ fullPage, stop, id }: { fullPage: boolean; stop: Schemas["StopLive"]; id: string }) {
  const held = stop.arm_held;
  const release = useRefusal("release_torque");
  const refusal = useRefusal("acknowledge");
  if (release === null) {
    return (
      <ResetButton
        fullPage={fullPage}
        held
        send={api.releaseTorque}
        refusal={null}
        next={t("common:stopped.releaseTorqueNext")}
      >
        {t("common:stopped.releaseTorque")}
      </ResetButton>
    );
  }
  // The list names this cause and what to do about it.
  const listed = stop.causes.find(({ code, cleared }) => !cleared && code === refusal?.code);
  return (
    <ResetButton
      fullPage={fullPage}
      held={held}
      send={api.acknowledge}
      refusal={refusal}
      {...(listed && { reasonId: causeId(id, listed) })}
      next={held ? t("common:stopped.letsGo") : t("common:stopped.startsNothing")}
    >
      {held ? t("common:stopped.acknowledgeHeld") : t("common:stopped.acknowledge")}
    </ResetButton>
  );
}

type ResetProps = {
  fullPage: boolean;
  /** True if the action releases an arm, so that the user must hold the button for one second. */
  held: boolean;
  send: (seen: Schemas["SeenState"]) => Promise<unknown>;
  refusal: ReturnType<typeof useRefusal>;
  /** The element that gives the reason of the refusal. Without it, the reason is shown below the button. */
  reasonId?: string;
  next: string;
  children: string;
};

function ResetButton({ fullPage, held, send, refusal, reasonId, next, children }: ResetProps) {
  const about = useId();
  const mutation = useMutation({ mutationFn: () => send(store.seen()) });
  const causes = useLive("stop")?.causes.map(({ code, axis }) => `${code} ${axis}`) ?? [];
  const possible = held && refusal === null && !mutation.isPending;
  const { holding, handlers } = useHold(possible, [children, ...causes].join(), () => mutation.mutate());
  const hint = held ? (holding === "again" ? t("common:stopped.again") : t("common:stopped.hold")) : "";
  return (
    <Stack gap={4}>
      <Button
        size={fullPage ? "xl" : "lg"}
        color="dark"
        disabled={refusal !== null}
        aria-describedby={reasonId ?? about}
        loading={mutation.isPending}
        {...(held
          ? { ...handlers, className: hold.held ?? "", "data-holding": holding }
          : { onClick: () => mutation.mutate() })}
      >
        {children}
      </Button>
      <Text size={fullPage ? "md" : "sm"} maw={320} mih={20} id={about} {...(held && { fw: 600 })}>
        {!refusal && [next, hint].filter(Boolean).join(" ")}
        {refusal && !reasonId && `${refusal.message} ${refusal.next_step}`}
      </Text>
      <ProblemNote error={mutation.error} />
    </Stack>
  );
}
