import { Paper, SimpleGrid, Stack, Text, Title } from "@mantine/core";
import type { Schemas } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { formatScore, itemName } from "./messages";
import { NumberPicker } from "./NumberPicker";
import { type Answers, spadiScore } from "./spadi";

const SUBSCALES = ["pain", "disability"] as const;

/** The answers to the SPADI questionnaire and the score so far. */
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
      <Text size="sm">{t("assessments:spadi.hint")}</Text>
      <SimpleGrid cols={{ base: 1, lg: 2 }} spacing="xl">
        {SUBSCALES.map((subscale) => (
          <Stack key={subscale} gap="sm">
            <Title order={3} size="h4">
              {t(`assessments:spadi.${subscale}`)}
            </Title>
            {items.map(
              (item, index) =>
                item.subscale === subscale && (
                  <NumberPicker
                    key={item.text}
                    label={`${index + 1}. ${itemName(item)}`}
                    value={answers[index] ?? null}
                    onChange={(answer) =>
                      onChange(answers.map((current, n) => (n === index ? answer : current)))
                    }
                  />
                ),
            )}
          </Stack>
        ))}
      </SimpleGrid>
      <Paper withBorder p="sm" pos="sticky" bottom={0} role="status">
        <Text fw={600}>
          {t("assessments:spadi.soFar", {
            total: formatScore(score.total),
            pain: formatScore(score.pain),
            disability: formatScore(score.disability),
          })}
        </Text>
        <Text size="sm">
          {unanswered === 0
            ? t("assessments:spadi.allAnswered")
            : t("assessments:spadi.unanswered", { number: unanswered })}
        </Text>
      </Paper>
    </Stack>
  );
}
