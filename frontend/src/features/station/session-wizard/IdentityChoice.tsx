import { Checkbox, Group, Text } from "@mantine/core";
import type { Schemas } from "../../../lib/api/client";
import { formatDay } from "../../../lib/format";
import { t } from "../../../lib/i18n";

export type Identifier = NonNullable<Schemas["CheckConfirmation"]["identifiers"]>[number];
/** Minimum number of identifiers. The service refuses fewer (`kata.clinic.sessions.identity`). */
export const IDENTIFIERS_NEEDED = 2;

/** Shows the identifiers of the record. The user ticks those that the patient has stated and that agree. */
export function IdentityChoice(props: {
  patient: Schemas["PatientIdentity"];
  chosen: Identifier[];
  onChange: (chosen: Identifier[]) => void;
}) {
  const { patient, chosen, onChange } = props;
  const name = patient.kana
    ? t("station:identity.nameAndKana", { name: patient.name, kana: patient.kana })
    : patient.name;
  const shown: [Identifier, string][] = [
    ["name", t("station:identity.name", { name })],
    ...(patient.birth_date
      ? [
          ["birth_date", t("station:identity.birthDate", { day: formatDay(patient.birth_date) })] satisfies [
            Identifier,
            string,
          ],
        ]
      : []),
    ["clinic_number", t("station:identity.clinicNumber", { number: patient.clinic_number })],
  ];
  return (
    <Checkbox.Group
      value={chosen}
      onChange={(values) => onChange(values as Identifier[])}
      label={<Text span>{t("station:identity.ask")}</Text>}
      data-testid="identity"
    >
      <Group gap={0} mt="xs" style={{ columnGap: "var(--mantine-spacing-lg)" }}>
        {shown.map(([identifier, label]) => (
          <Checkbox
            key={identifier}
            value={identifier}
            label={label}
            size="md"
            styles={{
              body: { minHeight: 44, alignItems: "center" },
              labelWrapper: { alignSelf: "stretch" },
              // A Japanese name is not cut within itself.
              label: { minHeight: 44, display: "flex", alignItems: "center", wordBreak: "keep-all" },
            }}
          />
        ))}
      </Group>
    </Checkbox.Group>
  );
}
