import { Button, Group, Progress, Stack, Text, Title } from "@mantine/core";
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { useEffect, useRef, useState } from "react";
import { useTitle } from "../../app/title";
import { api, type Me, type Schemas } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { AppFrame } from "../../safety/AppFrame";
import { ProblemNote } from "../../ui/ProblemNote";
import { LockScreen } from "../auth/LockScreen";
import { AnswerButtons } from "./AnswerButtons";
import classes from "./patientMode.module.css";

type Questionnaire = Schemas["PatientQuestionnaire"];
type Answers = Questionnaire["answers"];

/**
 * The content of a locked browser: the questionnaire if a patient uses the browser, else the lock screen. The
 * service refuses everything else until the user unlocks the screen.
 */
export function LockedBrowser({ me }: { me: Me }) {
  const [forStaff, setForStaff] = useState(false);
  const questionnaire = useQuery({
    queryKey: ["patient-questionnaire"],
    queryFn: api.patientQuestionnaire,
    retry: false,
    staleTime: Number.POSITIVE_INFINITY,
  });
  if (!questionnaire.data) return <LockScreen me={me} />;
  if (forStaff) return <LockScreen me={me} onBack={() => setForStaff(false)} />;
  return <PatientMode questionnaire={questionnaire.data} onStaff={() => setForStaff(true)} />;
}

/** Shows one question at a time in large letters, and then thanks the patient. Stop stays reachable. */
function PatientMode(props: { questionnaire: Questionnaire; onStaff: () => void }) {
  const { questionnaire, onStaff } = props;
  useTitle(questionnaire.title);
  return (
    <AppFrame>
      <Stack className={classes.page ?? ""} gap="xl" data-testid="patient-mode">
        {questionnaire.finished ? (
          <Stack gap="xl">
            <Title order={1} className={classes.question ?? ""}>
              {t("patient-mode:thanks")}
            </Title>
            <Text fz={24}>{t("patient-mode:giveBack")}</Text>
          </Stack>
        ) : (
          <Questions questionnaire={questionnaire} />
        )}
        <Group justify="space-between">
          <Text size="sm" lang={questionnaire.language}>
            {questionnaire.copyright}
          </Text>
          <Button variant="default" size="md" onClick={onStaff}>
            {t("patient-mode:forStaff")}
          </Button>
        </Group>
      </Stack>
    </AppFrame>
  );
}

/** Shows the questions one at a time, with the shoulder that is meant. Every step is stored, so that a reload continues at the same question. */
export function Questions({ questionnaire }: { questionnaire: Questionnaire }) {
  const queries = useQueryClient();
  const { questions } = questionnaire;
  const [answers, setAnswers] = useState<Answers>(questionnaire.answers);
  const [place, setPlace] = useState(() => firstOpen(questionnaire.answers));
  const heading = useRef<HTMLHeadingElement>(null);
  const save = useMutation({
    mutationFn: ({ finished }: { finished: boolean; next: number }) =>
      api.answerQuestionnaire({ answers, finished }),
    onSuccess: (stored, { finished, next }) => {
      if (finished) queries.setQueryData(["patient-questionnaire"], stored);
      else setPlace(next);
    },
  });
  // biome-ignore lint/correctness/useExhaustiveDependencies: the focus must move when the question changes.
  useEffect(() => heading.current?.focus(), [place]);
  const question = questions[place];
  const answered = answers.filter((answer) => answer !== null).length;
  return (
    <>
      <Progress size="lg" value={(100 * place) / questions.length} aria-label={t("patient-mode:progress")} />
      {question ? (
        <>
          <Text fz={22}>{t("patient-mode:place", { place: place + 1, of: questions.length })}</Text>
          <Text fz={26} fw={700}>
            {t(`patient-mode:shoulder.${questionnaire.side}`)}
          </Text>
          <Title
            order={1}
            ref={heading}
            tabIndex={-1}
            className={classes.question ?? ""}
            lang={questionnaire.language}
          >
            {question.text}
          </Title>
          <AnswerButtons
            question={question}
            language={questionnaire.language}
            value={answers[place] ?? null}
            onChange={(value) => setAnswers(answers.map((old, n) => (n === place ? value : old)))}
          />
        </>
      ) : (
        <Title order={1} ref={heading} tabIndex={-1} className={classes.question ?? ""}>
          {t("patient-mode:complete", { number: answered, of: questions.length })}
        </Title>
      )}
      <ProblemNote error={save.error} />
      <Group justify="space-between">
        <Button size="xl" variant="default" disabled={place === 0} onClick={() => setPlace(place - 1)}>
          {t("patient-mode:back")}
        </Button>
        <Button
          size="xl"
          variant={question && answers[place] === null ? "default" : "filled"}
          loading={save.isPending}
          onClick={() => save.mutate({ finished: !question, next: place + 1 })}
        >
          {describeNextStep(question !== undefined, answers[place] ?? null)}
        </Button>
      </Group>
    </>
  );
}

/** Return the index of the first unanswered question, or the number of questions if all are answered. */
const firstOpen = (answers: Answers) => {
  const open = answers.indexOf(null);
  return open === -1 ? answers.length : open;
};

function describeNextStep(isQuestion: boolean, answer: number | null): string {
  if (!isQuestion) return t("patient-mode:finish");
  return answer === null ? t("patient-mode:skip") : t("patient-mode:next");
}
