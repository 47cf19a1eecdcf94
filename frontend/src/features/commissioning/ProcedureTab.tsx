import "./catalogue";
import { Alert, Badge, Button, Card, Group, Loader, Skeleton, Stack, Text, Title } from "@mantine/core";
import { IconHandStop, IconInfoCircle } from "@tabler/icons-react";
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { type ReactNode, useEffect, useRef } from "react";
import { api, type Schemas } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { store } from "../../lib/live/store";
import { replaceData } from "../../lib/replaceData";
import { translateServerText } from "../../lib/serverText";
import { ButtonLink } from "../../ui/links";
import { ProblemNote } from "../../ui/ProblemNote";
import { useHasPermission } from "../auth/hooks";
import { GainTuning } from "./GainTuning";
import { Responses } from "./Responses";
import { StepResult, Values } from "./StepResult";

type Run = Schemas["CommissioningRunState"];
type Step = Schemas["CommissioningStepState"];

const KEY = ["commissioning-run"];
const POLL_MS = 400;

/** The guided procedure. It shows what a step will do, what the technician must do, and the step's result. */
export function ProcedureTab() {
  const queries = useQueryClient();
  const run = useQuery({
    queryKey: KEY,
    queryFn: api.commissioningRun,
    refetchInterval: (query) => (query.state.data?.running ? POLL_MS : false),
  });
  const take = (state: Run) => replaceData(queries, KEY, state);
  const start = useMutation({ mutationFn: api.startCommissioning, onSuccess: take });
  const confirm = useMutation({ mutationFn: api.confirmCommissioning, onSuccess: take });
  const passed = run.data?.passed;
  useEffect(() => {
    // The procedure has finished and has written a record.
    if (passed === null || passed === undefined) return;
    for (const key of ["commissionings", "commissioning-status", "station-versions"])
      void queries.invalidateQueries({ queryKey: [key] });
  }, [passed, queries]);
  const state = run.data;
  return (
    <Stack>
      <ProblemNote error={run.error ?? start.error ?? confirm.error} />
      {run.isPending && <Skeleton h={320} />}
      {state && (
        <>
          <Intro
            run={state}
            starting={start.isPending}
            onStart={(wanted) => {
              confirm.reset();
              start.mutate(wanted);
            }}
          />
          {state.running && (
            <Present run={state}>
              {state.instruction && (
                <Instruction
                  key={state.instruction.number}
                  instruction={state.instruction}
                  practice={state.practice}
                  busy={confirm.isPending}
                  onConfirm={(answer) => confirm.mutate(answer)}
                />
              )}
            </Present>
          )}
          <Steps run={state} />
        </>
      )}
    </Stack>
  );
}

/** Says what will happen, starts the procedure, and shows how it ended. */
function Intro(props: {
  run: Run;
  starting: boolean;
  onStart: (wanted: Schemas["CommissioningStart"]) => void;
}) {
  const { run, starting, onStart } = props;
  const permitted = useHasPermission("commission");
  const mayStart = permitted && run.possible && !run.running;
  return (
    <Card withBorder component="section" aria-label={t("commissioning:run.title")}>
      <Stack gap="sm">
        {run.running ? (
          <Text role="status">
            {t("commissioning:run.running", { who: run.by })} {t("commissioning:run.stopHint")}
          </Text>
        ) : (
          <Text>{t(run.practice ? "commissioning:run.practice" : "commissioning:run.before")}</Text>
        )}
        {!run.possible && <Text fw={600}>{t("commissioning:run.noFile")}</Text>}
        {run.passed === true && (
          <Alert color="indigo" variant="light" role="status" data-testid="finished">
            <Stack gap="sm" align="flex-start">
              {t(`commissioning:run.passed.${run.kind}`, { presses: run.presses })}
              <ButtonLink to="/commissioning" search={{ tab: "records" }} variant="default">
                {t("commissioning:run.showRecord")}
              </ButtonLink>
            </Stack>
          </Alert>
        )}
        {run.passed === false && (
          <Alert color="grape" variant="light" icon={<IconInfoCircle />} role="alert" data-testid="finished">
            {t(run.practice ? "commissioning:run.failedPractice" : "commissioning:run.failed")}
          </Alert>
        )}
        {mayStart && run.may_repeat && <Text size="sm">{t("commissioning:run.tuneAgainExplain")}</Text>}
        {mayStart && (
          <Group>
            <Button size="md" loading={starting} onClick={() => onStart({ ...store.seen(), kind: "full" })}>
              {t(run.practice ? "commissioning:run.startPractice" : "commissioning:run.start")}
            </Button>
            {run.may_check && (
              <Button
                size="md"
                variant="default"
                loading={starting}
                onClick={() => onStart({ ...store.seen(), kind: "check" })}
              >
                {t("commissioning:run.startCheck")}
              </Button>
            )}
            {run.may_repeat && (
              <Button
                size="md"
                variant="default"
                loading={starting}
                onClick={() => onStart({ ...store.seen(), kind: "full", begin: "gains" })}
              >
                {t("commissioning:run.tuneAgain")}
              </Button>
            )}
          </Group>
        )}
      </Stack>
    </Card>
  );
}

/** Shows which step runs, and its instruction. Between two instructions it says that the technician waits. */
function Present({ run, children }: { run: Run; children: ReactNode }) {
  const place = run.steps.findIndex((step) => step.key === run.step);
  const step = run.steps[place];
  return (
    <Card withBorder component="section" aria-label={t("commissioning:run.present")} data-testid="present">
      <Stack gap="sm">
        <Text size="sm" c="dimmed">
          {step
            ? t("commissioning:run.place", {
                number: place + 1,
                count: run.steps.length,
                title: translateServerText(step.title, step.title_key),
              })
            : t("commissioning:run.starting")}
        </Text>
        {children || (
          <Group gap="sm" wrap="nowrap" role="status">
            <Loader size="sm" aria-hidden />
            <Text fz="lg" fw={600}>
              {t("commissioning:run.working")}
            </Text>
          </Group>
        )}
      </Stack>
    </Card>
  );
}

/** Shows what the technician must do now. */
function Instruction(props: {
  instruction: Schemas["CommissioningInstruction"];
  practice: boolean;
  busy: boolean;
  onConfirm: (answer: Schemas["CommissioningConfirmation"]) => void;
}) {
  const { instruction, practice, busy, onConfirm } = props;
  const button = useRef<HTMLButtonElement>(null);
  useEffect(() => button.current?.focus(), []);
  return (
    <section
      aria-label={t("commissioning:run.instruction")}
      data-testid="instruction"
      data-number={instruction.number}
    >
      <Stack gap="sm" aria-live="assertive">
        <Group gap="sm" wrap="nowrap">
          <IconHandStop size={28} aria-hidden />
          <Text fz="lg" fw={600}>
            {translateServerText(instruction.text, instruction.text_key)}
          </Text>
        </Group>
        {!instruction.press && <Text size="sm">{t("commissioning:run.seen")}</Text>}
        {instruction.press && !instruction.review && (
          <Group>
            <Button
              ref={button}
              size="lg"
              loading={busy}
              onClick={() => onConfirm({ ...store.seen(), number: instruction.number })}
            >
              {t(practice ? "commissioning:run.doIt" : "commissioning:run.done")}
            </Button>
          </Group>
        )}
      </Stack>
      {instruction.press && instruction.review && (
        <GainTuning
          review={instruction.review}
          busy={busy}
          onAnswer={(gains) => onConfirm({ ...store.seen(), number: instruction.number, gains })}
        />
      )}
    </section>
  );
}

const COLOURS: Record<Step["state"], string> = {
  waiting: "gray",
  running: "indigo",
  passed: "gray",
  failed: "grape",
};

/** All steps in their order, each with its result. */
function Steps({ run }: { run: Run }) {
  return (
    <Stack component="ol" gap="xs" p={0} m={0} data-testid="steps" style={{ listStyle: "none" }}>
      {run.steps.map((step, place) => (
        <Card
          key={step.key}
          component="li"
          withBorder
          padding="sm"
          data-testid={`step-${step.key}`}
          data-state={step.state}
          {...(step.state === "running" && { "aria-current": "step" as const })}
        >
          <Group gap="sm" mb={4}>
            {step.state === "running" && <Loader size="xs" aria-hidden />}
            <Title order={3} size="h5">
              {t("commissioning:run.step", {
                number: place + 1,
                title: translateServerText(step.title, step.title_key),
              })}
            </Title>
            <Badge
              variant={step.state === "waiting" ? "outline" : "light"}
              color={COLOURS[step.state]}
              tt="none"
            >
              {t(`commissioning:run.states.${step.state}`)}
            </Badge>
          </Group>
          <StepDetails step={step} />
        </Card>
      ))}
    </Stack>
  );
}

function StepDetails({ step }: { step: Step }) {
  return (
    <Stack gap={4}>
      <Text size="sm">{translateServerText(step.description, step.description_key)}</Text>
      {step.result && !step.result.passed && <StepResult run={step.result} />}
      {step.result && step.result.curves.length > 0 && <Responses responses={step.result.curves} />}
      {step.result && step.result.values.length > 0 && (
        <details>
          <summary>{t("commissioning:run.values", { count: step.result.values.length })}</summary>
          <Values values={step.result.values} />
        </details>
      )}
    </Stack>
  );
}
