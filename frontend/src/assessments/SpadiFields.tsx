import { Paper, SimpleGrid, Stack, Text, Title } from "@mantine/core";
import type { Schemas } from "../api/client";
import { NumberPicker } from "./NumberPicker";
import { type Answers, spadiScore } from "./spadi";
import { formatScore } from "./words";

const HALVES = [
  { subscale: "pain", title: "How bad is the pain? 0 none, 10 the worst imaginable" },
  { subscale: "disability", title: "How hard is it? 0 not at all, 10 so hard that help is needed" },
] as const;

/** The answers of the patient's own sheet, and what they come to so far. */
export function SpadiFields(props: {
  items: Schemas["SpadiItem"][];
  answers: Answers;
  onChange: (answers: Answers) => void;
}) {
  const { items, answers, onChange } = props;
  const score = spadiScore(items, answers);
  const unanswered = answers.filter((answer) => answer === null).length;
  return (
    <Stack>
      <Text size="sm">
        The items are named here in short, in the order of the questionnaire that the patient has filled in.
      </Text>
      <SimpleGrid cols={{ base: 1, lg: 2 }} spacing="xl">
        {HALVES.map((half) => (
          <Stack key={half.subscale} gap="sm">
            <Title order={3} size="h4">
              {half.title}
            </Title>
            {items.map(
              (item, place) =>
                item.subscale === half.subscale && (
                  <NumberPicker
                    key={item.text}
                    label={`${place + 1}. ${item.text}`}
                    value={answers[place] ?? null}
                    onChange={(answer) =>
                      onChange(answers.map((before, other) => (other === place ? answer : before)))
                    }
                  />
                ),
            )}
          </Stack>
        ))}
      </SimpleGrid>
      <Paper withBorder p="sm" pos="sticky" bottom={0} role="status">
        <Text fw={600}>
          SPADI {formatScore(score.total)} of 100: pain {formatScore(score.pain)}, disability{" "}
          {formatScore(score.disability)}
        </Text>
        <Text size="sm">
          {unanswered === 0
            ? "All 13 answered."
            : `${unanswered} of 13 not answered. Up to two may be left out of each half.`}
        </Text>
      </Paper>
    </Stack>
  );
}
