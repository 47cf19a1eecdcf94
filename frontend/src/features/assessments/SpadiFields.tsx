import { Paper, SimpleGrid, Stack, Text, Title } from "@mantine/core";
import type { Schemas } from "../../lib/api/client";
import { formatScore, itemName, SPADI } from "./messages";
import { NumberPicker } from "./NumberPicker";
import { type Answers, spadiScore } from "./spadi";

const HALVES = ["pain", "disability"] as const;

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
      <Text size="sm">{SPADI.short}</Text>
      <SimpleGrid cols={{ base: 1, lg: 2 }} spacing="xl">
        {HALVES.map((half) => (
          <Stack key={half} gap="sm">
            <Title order={3} size="h4">
              {SPADI[half]}
            </Title>
            {items.map(
              (item, place) =>
                item.subscale === half && (
                  <NumberPicker
                    key={item.text}
                    label={`${place + 1}. ${itemName(item)}`}
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
          {SPADI.soFar(formatScore(score.total), formatScore(score.pain), formatScore(score.disability))}
        </Text>
        <Text size="sm">{unanswered === 0 ? SPADI.allAnswered : SPADI.unanswered(unanswered)}</Text>
      </Paper>
    </Stack>
  );
}
