import "./catalogue";
import { Alert, Button, Group, NumberInput, Stack, Table, Text } from "@mantine/core";
import { useState } from "react";
import type { Schemas } from "../../lib/api/client";
import { formatList } from "../../lib/format";
import { t } from "../../lib/i18n";
import { LANGUAGE } from "../../lib/language";
import { translateServerText } from "../../lib/serverText";
import { ScrolledTable } from "../../ui/ScrolledTable";
import { Responses } from "./Responses";
import { changedMotors, GAINS, type Gains, outsideLimits, sameGains } from "./tuning";

type Review = Schemas["GainTuningReview"];
type Motor = Schemas["MotorTuning"];
type Answer = Schemas["GainsAnswer"];

const FIXED_2 = new Intl.NumberFormat(LANGUAGE, { minimumFractionDigits: 2, maximumFractionDigits: 2 });
const PERCENT = new Intl.NumberFormat(LANGUAGE, { maximumFractionDigits: 0 });

/** Shows the step responses beside the former ones, and lets the technician keep, change or take back gains. */
export function GainTuning(props: { review: Review; busy: boolean; onAnswer: (answer: Answer) => void }) {
  const { review, busy, onAnswer } = props;
  const { motors } = review;
  const [next, setNext] = useState(motors.map((motor) => motor.proposed));
  const proposed = motors.filter((motor) => !sameGains(motor.proposed, motor.gains));
  const changed = motors.some((motor, n) => !sameGains(motor.gains, next[n] ?? motor.gains));
  const outside = motors.some((motor, n) => outsideLimits(motor, next[n] ?? motor.gains));
  return (
    <Stack gap="sm" data-testid="gain-tuning">
      <Text>
        {proposed.length > 0
          ? t("commissioning:tuning.proposals", {
              motors: formatList(proposed.map((motor) => String(motor.motor))),
            })
          : t("commissioning:tuning.noProposals")}
      </Text>
      {review.fault && (
        <Alert color="grape" variant="light" role="status">
          {t("commissioning:tuning.fault", { fault: translateServerText(review.fault, review.fault_key) })}
        </Alert>
      )}
      <Group>
        <Button size="lg" loading={busy} onClick={() => onAnswer({ action: "keep" })}>
          {t("commissioning:tuning.keep")}
        </Button>
        {motors[0]?.former_gains && (
          <Button
            size="lg"
            variant="default"
            loading={busy}
            onClick={() => onAnswer({ action: "take_back" })}
          >
            {t("commissioning:tuning.takeBack")}
          </Button>
        )}
        <Button
          size="lg"
          variant="default"
          loading={busy}
          disabled={!changed || outside}
          onClick={() => onAnswer({ action: "measure", gains: next })}
        >
          {t("commissioning:tuning.measure")}
        </Button>
      </Group>
      <Responses responses={[...review.former_curves, ...review.curves]} />
      <TuningTable
        motors={motors}
        next={next}
        onChange={(place, gains) => setNext(next.map((own, n) => (n === place ? gains : own)))}
      />
    </Stack>
  );
}

function TuningTable(props: {
  motors: Motor[];
  next: Gains[];
  onChange: (place: number, gains: Gains) => void;
}) {
  const { motors, next, onChange } = props;
  const changed = changedMotors(motors);
  return (
    <ScrolledTable minWidth={760}>
      <Table verticalSpacing={4} fz="sm" aria-label={t("commissioning:tuning.table")}>
        <Table.Thead>
          <Table.Tr>
            <Table.Th>{t("commissioning:tuning.motor")}</Table.Th>
            <Table.Th>{t("commissioning:tuning.gains")}</Table.Th>
            {GAINS.map((gain) => (
              <Table.Th key={gain} ta="right">
                {t(`commissioning:tuning.${gain}`)}
              </Table.Th>
            ))}
            <Table.Th ta="right">{t("commissioning:tuning.rise")}</Table.Th>
            <Table.Th ta="right">{t("commissioning:tuning.overshoot")}</Table.Th>
            <Table.Th ta="right">{t("commissioning:tuning.error")}</Table.Th>
          </Table.Tr>
        </Table.Thead>
        <Table.Tbody>
          {motors.flatMap((motor, place) => [
            motor.former_gains && changed.includes(motor.motor) && (
              <Table.Tr key={`${motor.motor} former`} data-testid={`motor-${motor.motor}-former`}>
                <Table.Td>{motor.motor}</Table.Td>
                <Table.Td>{t("commissioning:tuning.former")}</Table.Td>
                <Numbers gains={motor.former_gains} response={motor.former_response} />
              </Table.Tr>
            ),
            <Table.Tr key={`${motor.motor} present`} data-testid={`motor-${motor.motor}-present`}>
              <Table.Td>{motor.motor}</Table.Td>
              <Table.Td>{t("commissioning:tuning.present")}</Table.Td>
              <Numbers gains={motor.gains} response={motor.response} />
            </Table.Tr>,
            <Table.Tr key={`${motor.motor} next`}>
              <Table.Td>{motor.motor}</Table.Td>
              <Table.Td>{t("commissioning:tuning.next")}</Table.Td>
              <NextGains
                motor={motor}
                gains={next[place] ?? motor.gains}
                onChange={(gains) => onChange(place, gains)}
              />
              <Table.Td colSpan={3}>{translateServerText(motor.advice, motor.advice_key)}</Table.Td>
            </Table.Tr>,
          ])}
        </Table.Tbody>
      </Table>
    </ScrolledTable>
  );
}

/** The cells of gains and figures. */
function Numbers({ gains, response }: { gains: Gains; response: Schemas["StepFigures"] | null }) {
  return (
    <>
      {GAINS.map((gain) => (
        <Table.Td key={gain} ta="right">
          {gains[gain]}
        </Table.Td>
      ))}
      {response ? (
        <>
          <Table.Td ta="right">{FIXED_2.format(response.rise_s)}</Table.Td>
          <Table.Td ta="right">{PERCENT.format(100 * response.overshoot)}</Table.Td>
          <Table.Td ta="right">{FIXED_2.format(response.steady_error_deg)}</Table.Td>
        </>
      ) : (
        <Table.Td colSpan={3} ta="right">
          {t("commissioning:tuning.notMeasured")}
        </Table.Td>
      )}
    </>
  );
}

/** The cells in which the technician enters the gains of the next measurement. */
function NextGains(props: { motor: Motor; gains: Gains; onChange: (gains: Gains) => void }) {
  const { motor, gains, onChange } = props;
  return GAINS.map((gain) => {
    const limits = { low: motor.lowest[gain], high: motor.highest[gain] };
    const inside = gains[gain] >= limits.low && gains[gain] <= limits.high;
    return (
      <Table.Td key={gain} ta="right">
        <NumberInput
          size="xs"
          w={100}
          ml="auto"
          hideControls
          allowDecimal={false}
          allowNegative={false}
          aria-label={t("commissioning:tuning.field", {
            motor: motor.motor,
            gain: t(`commissioning:values.${gain} gain`),
          })}
          description={inside ? t("commissioning:tuning.range", limits) : undefined}
          error={!inside && t("commissioning:tuning.outside", limits)}
          inputWrapperOrder={["input", "description", "error"]}
          styles={{ input: { textAlign: "right" } }}
          value={gains[gain]}
          onChange={(value) => onChange({ ...gains, [gain]: typeof value === "number" ? value : 0 })}
        />
      </Table.Td>
    );
  });
}
