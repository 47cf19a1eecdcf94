import { Button, CopyButton, Group, Select, Stack, Text, TextInput } from "@mantine/core";
import { IconCheck, IconCopy } from "@tabler/icons-react";
import { useQuery, useQueryClient } from "@tanstack/react-query";
import { useState } from "react";
import { api, type Schemas } from "../../lib/api/client";
import { t } from "../../lib/i18n";
import { ProblemNote } from "../../ui/ProblemNote";
import { AccessTokenList } from "./AccessTokenList";
import { ReauthenticateForm } from "./ReauthenticateForm";

const QUERY = "own-access-tokens";
const VALID_DAYS = [30, 90, 365];

/** The access tokens of the user's programs, and the form that creates one. */
export function AccessTokens() {
  const queries = useQueryClient();
  const tokens = useQuery({ queryKey: [QUERY], queryFn: api.ownAccessTokens });
  const [created, setCreated] = useState<Schemas["CreatedAccessToken"] | null>(null);
  return (
    <Stack>
      <Text>{t("auth:tokens.hint")}</Text>
      <ProblemNote error={tokens.error} />
      {tokens.data?.items.length === 0 && <Text>{t("auth:tokens.noneOwn")}</Text>}
      <AccessTokenList tokens={tokens.data?.items ?? []} queryKey={QUERY} revoke={api.revokeOwnAccessToken} />
      {created ? (
        <NewToken token={created} onDone={() => setCreated(null)} />
      ) : (
        <CreateToken
          onCreated={(token) => {
            setCreated(token);
            void queries.invalidateQueries({ queryKey: [QUERY] });
          }}
        />
      )}
    </Stack>
  );
}

function CreateToken({ onCreated }: { onCreated: (token: Schemas["CreatedAccessToken"]) => void }) {
  const [name, setName] = useState("");
  const [days, setDays] = useState(VALID_DAYS[0] ?? 30);
  return (
    <Stack>
      <Group align="end">
        <TextInput
          label={t("auth:tokens.name")}
          description={t("auth:tokens.nameHint")}
          autoComplete="off"
          maxLength={100}
          value={name}
          onChange={(event) => setName(event.currentTarget.value)}
        />
        <Select
          label={t("auth:tokens.validFor")}
          data={VALID_DAYS.map((value) => ({
            value: String(value),
            label: t("auth:tokens.days", { days: value }),
          }))}
          allowDeselect={false}
          value={String(days)}
          onChange={(value) => setDays(Number(value))}
        />
      </Group>
      <ReauthenticateForm
        disabled={name.trim() === ""}
        action={(password) => api.createAccessToken({ name, valid_days: days, password })}
        onDone={onCreated}
      >
        {t("auth:tokens.create")}
      </ReauthenticateForm>
    </Stack>
  );
}

/** A new token, shown once. */
function NewToken({ token, onDone }: { token: Schemas["CreatedAccessToken"]; onDone: () => void }) {
  return (
    <Stack>
      <Text fw={600}>{t("auth:tokens.shownOnce", { name: token.name })}</Text>
      <Text ff="monospace" data-testid="access-token" style={{ overflowWrap: "anywhere" }}>
        {token.token}
      </Text>
      <Group>
        <CopyButton value={token.token}>
          {({ copied, copy }) => (
            <Button
              variant="default"
              leftSection={copied ? <IconCheck size={20} /> : <IconCopy size={20} />}
              onClick={copy}
            >
              {copied ? t("auth:tokens.copied") : t("auth:tokens.copy")}
            </Button>
          )}
        </CopyButton>
        <Button onClick={onDone}>{t("auth:tokens.stored")}</Button>
      </Group>
    </Stack>
  );
}
